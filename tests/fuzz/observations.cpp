/// Observations as CSV: whatever the bytes, they are a record that is written as text which reads back as the
/// same one and can be cut into windows, or an InputError. The first byte chooses kind and dimension.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>

#include "wienertree/filter/window.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace wienertree;
  if (size == 0) return 0;
  const auto kind = bytes[0] % 2 == 0 ? ObservationKind::continuous : ObservationKind::discrete;
  const std::size_t dimension = 1 + bytes[0] / 2 % 3;
  std::istringstream in(std::string(reinterpret_cast<const char*>(bytes) + 1, size - 1));
  try {
    const ObservationPath path = read_observations(in, "y.csv", dimension, kind);
    std::ostringstream out, again;
    write_observations(out, path);
    std::istringstream written(out.str());
    write_observations(again, read_observations(written, "written.csv", dimension, kind));
    if (again.str() != out.str()) std::abort();
    const ObservationWindows windows(path, kind, ObservationTiming::current, 0);
    ObservationWindow window;
    for (std::size_t j = 0; j < windows.size(); ++j) windows.get(j, window);
  } catch (const InputError& refusal) {
    if (refusal.where().starts_with("written.csv")) std::abort();
  }
  return 0;
}
