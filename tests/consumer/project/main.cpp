// A project outside the source tree: verifies a constructed formula with the installed library.
#include <cmath>
#include <wienertree/cubature/construct.hpp>
#include <wienertree/cubature/verification.hpp>

int main() {
  const auto formula = wienertree::construct(5, 2);
  return wienertree::verify(formula).max_error < 1e-12 ? 0 : 1;
}
