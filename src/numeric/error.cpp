#include "wienertree/numeric/error.hpp"

#include <utility>

namespace wienertree {

Error::Error(std::string message, std::string where, std::string value)
    : std::runtime_error(where + (where.empty() ? "" : ": ") + message +
                         (value.empty() ? "" : " (" + value + ")")),
      message_(std::move(message)),
      where_(std::move(where)),
      value_(std::move(value)) {}

}  // namespace wienertree
