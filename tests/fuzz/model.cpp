/// A model file: whatever the bytes, it is a model that can be evaluated and printed, or an InputError.
#include <cstddef>
#include <cstdint>

#include "wienertree/model/text_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace wienertree;
  try {
    const TextModel source = TextModel::parse({reinterpret_cast<const char*>(bytes), size}, "model.toml");
    const Model& model = source.model();
    const std::size_t d = model.state_dimension();
    Batch x(d, 3), drift(d, 3);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < 3; ++n) x(i, n) = model.initial[i] + static_cast<double>(n);
    model.fields->ito_drift(x, drift);
  } catch (const InputError&) {  // what bad input is to give
  }
  return 0;
}
