#pragma once
/// The bytes of a fuzzer as a file in memory, for readers that take a file's name.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

class FuzzedFile {
 public:
  FuzzedFile(const std::uint8_t* bytes, std::size_t size) : descriptor_(::memfd_create("fuzzed", 0)) {
    if (::write(descriptor_, bytes, size) < 0) return;
    ::lseek(descriptor_, 0, SEEK_SET);
  }
  ~FuzzedFile() { ::close(descriptor_); }
  FuzzedFile(const FuzzedFile&) = delete;
  FuzzedFile& operator=(const FuzzedFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};
