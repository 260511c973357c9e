#pragma once
/// The one exception family of the library. Nothing in the library prints or exits.
#include <stdexcept>
#include <string>

namespace wienertree {

/// What went wrong, where (file and key, step and node, option name), and the offending value as text (may be
/// empty). `what()` reads "where: message (value)".
class Error : public std::runtime_error {
 public:
  Error(std::string message, std::string where, std::string value = {});
  const std::string& message() const noexcept { return message_; }
  const std::string& where() const noexcept { return where_; }
  const std::string& value() const noexcept { return value_; }

 private:
  std::string message_, where_, value_;
};

/// The caller's input is wrong: a file, an option, a model. The program exits with 2.
class InputError : public Error {
  using Error::Error;
};

/// The computation failed on valid input: an ODE, a posterior without mass. The program exits with 1.
class RunError : public Error {
  using Error::Error;
};

}  // namespace wienertree
