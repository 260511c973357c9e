#include "checkpoint.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <fstream>

#include "run_files.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/numeric/read_all.hpp"
#include "wienertree/run/checksum.hpp"

namespace wienertree::app {
namespace {

constexpr std::string_view magic = "wienertree checkpoint ", version = "1";
constexpr double largest_share_of_time = 0.02;

std::string eight_bytes(std::uint64_t number) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
  return bytes;
}

Json with_byte_order(Json run) {
  run["byte order"] = std::endian::native == std::endian::little ? "little" : "big";
  return run;
}

// "/options/nodes" as "options nodes".
std::string spoken(std::string path) {
  for (char& c : path)
    if (c == '/') c = ' ';
  return path.substr(path.empty() ? 0 : 1);
}

void require_same(const Json& saved, const Json& asked, const std::string& file) {
  const Json was = saved.flatten(), is = asked.flatten();
  const auto shown = [](const Json& run, const std::string& key) {
    return run.contains(key) ? run[key].dump() : std::string("none");
  };
  const auto compare = [&](const std::string& key) {
    if (shown(was, key) != shown(is, key))
      throw InputError(fmt::format("is the checkpoint of another run: {} was {}, and is {}", spoken(key),
                                   shown(was, key), shown(is, key)),
                       "--resume", file);
  };
  for (const auto& [key, value] : is.items()) compare(key);
  for (const auto& [key, value] : was.items()) compare(key);
}

}  // namespace

Checkpoint::Checkpoint(const std::string& file, double seconds_between, Json run)
    : file_("--checkpoint", file),
      between_(seconds_between),
      next_(Clock::now() + std::chrono::duration_cast<Clock::duration>(between_)),
      opening_(fmt::format("{}{}\n{}\n", magic, version, with_byte_order(std::move(run)).dump())) {
  if (file == "-") throw InputError("must be a file", "--checkpoint", file);
}

bool Checkpoint::due() const { return Clock::now() >= next_; }

void Checkpoint::write(std::string_view state) {
  const auto began = Clock::now();
  std::string content = opening_;
  content += state;
  content += eight_bytes(checksum(content));
  file_.stage(std::move(content));
  file_.publish();
  const std::chrono::duration<double> took = Clock::now() - began;
  next_ = Clock::now() +
          std::chrono::duration_cast<Clock::duration>(std::max(between_, took / largest_share_of_time));
}

std::string read_checkpoint(const std::string& file, const Json& run) {
  const auto refuse = [&](const std::string& message) { throw InputError(message, "--resume", file); };
  note_input("--resume", file);
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse("cannot be opened");
  // Held twice while it is read: as bytes, and as what they stand for.
  const std::string content = read_all(in, static_cast<std::size_t>(memory_limit() / 2), "--resume " + file);
  if (in.bad() || content.empty()) refuse("cannot be read, or is empty");
  if (!content.starts_with(magic)) refuse("is not a checkpoint");
  const std::size_t first = content.find('\n'), second = content.find('\n', first + 1);
  const std::string format = content.substr(magic.size(), std::min(first, magic.size() + 20) - magic.size());
  if (format != version)
    refuse(fmt::format("is a checkpoint of format {}, and this program reads {}", format, version));
  constexpr std::size_t size_of_sum = 8;
  if (second == std::string::npos || content.size() - second - 1 < size_of_sum)
    refuse("is damaged: it ends early");
  const std::size_t end = content.size() - size_of_sum;
  if (content.substr(end) != eight_bytes(checksum(std::string_view(content).substr(0, end))))
    refuse("is damaged: its checksum does not match");
  const Json saved = Json::parse(content.substr(first + 1, second - first - 1), nullptr, false);
  if (saved.is_discarded()) refuse("is damaged: its second line is not JSON");
  require_same(saved, with_byte_order(run), file);
  return content.substr(second + 1, end - second - 1);
}

}  // namespace wienertree::app
