/// An expression: whatever the bytes, it is a function that can be evaluated, or an InputError.
#include <array>
#include <cstddef>
#include <cstdint>

#include "wienertree/model/text_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace wienertree;
  static const TextModel model = TextModel::parse(
      "name = \"m\"\nconvention = \"ito\"\n[parameters]\nr = 0.5\n[state]\nx = { initial = 1.0 }\n"
      "v = { initial = 2.0 }\n[drift]\nx = \"r*v\"\nv = \"0\"\n[diffusion]\nx = [\"1\"]\nv = [\"x\"]\n",
      "model.toml");
  const std::string_view expression(reinterpret_cast<const char*>(bytes), size);
  try {
    const BatchFunction payoff = model.compile(expression, "--payoff");
    Batch x(2, 2);
    for (std::size_t n = 0; n < 2; ++n) x(0, n) = x(1, n) = static_cast<double>(n);
    std::array<double, 2> value{};
    payoff(x, value);
    model.compile_kinked(expression, "--payoff");
  } catch (const InputError&) {  // what bad input is to give
  }
  return 0;
}
