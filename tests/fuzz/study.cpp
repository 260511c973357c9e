/// A study file, in both sizes: whatever the bytes, it is a study or an InputError.
#include "../../apps/study/study_file.hpp"
#include "file.hpp"
#include "wienertree/numeric/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const FuzzedFile file(bytes, size);
  for (const bool full : {false, true}) {
    try {
      wienertree::app::read_study(file.path(), full);
    } catch (const wienertree::InputError&) {  // what bad input is to give
    }
  }
  return 0;
}
