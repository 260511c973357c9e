/// A formula as JSON, of paths and of Lie polynomials: whatever the bytes, it is a formula that is written as
/// text which reads back as the same one, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/lie_formula_file.hpp"
#include "wienertree/numeric/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace wienertree;
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  try {
    const std::string written = format_formula(parse_formula(text, "formula.json"));
    if (format_formula(parse_formula(written, "written.json")) != written) std::abort();
  } catch (const InputError& refusal) {
    if (refusal.where().starts_with("written.json")) std::abort();
  }
  try {
    const std::string written = format_formula(parse_lie_formula(text, "formula.json"));
    if (format_formula(parse_lie_formula(written, "written.json")) != written) std::abort();
  } catch (const InputError& refusal) {
    if (refusal.where().starts_with("written.json")) std::abort();
  }
  return 0;
}
