#pragma once
/// The state of a computation as bytes, so that it can be put down and taken up again.
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {

/// Collects values as bytes, or gives them back in the same order: one function, which names the values once,
/// serves both ways. Numbers are stored as they lie in memory; counts as 64-bit numbers before what they
/// count.
///
/// A type of one's own takes part by a function `exchange(StateArchive&, T&)` beside it, or a member
/// `exchange(StateArchive&)`.
class StateArchive {
 public:
  /// Collects.
  StateArchive() = default;
  /// Gives back. The bytes must outlive the archive.
  explicit StateArchive(std::string_view bytes) : rest_(bytes), reading_(true) {}

  bool reading() const { return reading_; }
  /// What was collected.
  const std::string& bytes() const { return collected_; }

  /// @throws InputError if the bytes end too early
  template <class... T>
  void operator()(T&... values) {
    (pass(values), ...);
  }
  /// @throws InputError unless `fits`: for what was read and does not belong together
  static void require(bool fits) {
    if (!fits) throw InputError("does not hold the state of such a run", "checkpoint");
  }
  /// @throws InputError if bytes are left over
  void finish() const { require(rest_.empty()); }

 private:
  template <class T>
  static constexpr bool is_plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

  void pass_bytes(void* data, std::size_t size) {
    if (size == 0) return;
    if (!reading_) {
      collected_.append(static_cast<const char*>(data), size);
      return;
    }
    require(size <= rest_.size());
    std::memcpy(data, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  // Nothing is allocated for more than the bytes can hold.
  std::size_t pass_count(std::size_t count, std::size_t size_of_each) {
    std::uint64_t number = count;
    pass_bytes(&number, sizeof number);
    if (reading_) require(number <= rest_.size() / size_of_each);
    return number;
  }

  template <class T>
  void pass(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t number = value ? 1 : 0;
      pass_bytes(&number, 1);
      require(number <= 1);
      value = number == 1;
    } else if constexpr (is_plain<T>) {
      pass_bytes(&value, sizeof value);
    } else if constexpr (requires { value.exchange(*this); }) {
      value.exchange(*this);
    } else if constexpr (requires { value.resize(value.rows(), value.cols()); }) {  // a matrix of Eigen
      auto rows = value.rows(), columns = value.cols();
      pass_bytes(&rows, sizeof rows);
      pass_bytes(&columns, sizeof columns);
      if (reading_) {
        const auto most = static_cast<std::int64_t>(rest_.size() / sizeof(double));
        constexpr std::int64_t fixed_rows = T::RowsAtCompileTime, fixed_columns = T::ColsAtCompileTime;
        require((fixed_rows < 0 || rows == fixed_rows) && (fixed_columns < 0 || columns == fixed_columns));
        require(rows >= 0 && columns >= 0 && (rows == 0 || columns <= most / rows));
        value.resize(rows, columns);
      }
      pass_bytes(value.data(), static_cast<std::size_t>(value.size()) * sizeof(double));
    } else {
      exchange(*this, value);
    }
  }
  template <class T, class Allocator>
  void pass(std::vector<T, Allocator>& values) {
    values.resize(pass_count(values.size(), is_plain<T> ? sizeof(T) : 1));
    if constexpr (is_plain<T>) {
      pass_bytes(values.data(), values.size() * sizeof(T));
    } else {
      for (T& value : values) pass(value);
    }
  }
  template <class T>
  void pass(std::optional<T>& value) {
    bool present = value.has_value();
    pass(present);
    if (!present) return value.reset();
    if (!value) value.emplace();
    pass(*value);
  }
  void pass(std::string& text) {
    text.resize(pass_count(text.size(), 1));
    pass_bytes(text.data(), text.size());
  }
  void pass(Batch& batch) {
    std::uint64_t components = batch.components();
    pass(components);
    const std::size_t nodes = pass_count(batch.nodes(), 1);
    if (reading_) {
      require(components == 0 || nodes <= rest_.size() / sizeof(double) / components);
      batch.reshape(components, nodes);
    }
    pass_bytes(batch.view().data(), components * nodes * sizeof(double));
  }

  std::string collected_;
  std::string_view rest_;
  bool reading_ = false;
};

}  // namespace wienertree
