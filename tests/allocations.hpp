#pragma once
#include <cstddef>

namespace wienertree::test {

/// Calls of operator new in this program so far, by all threads. Link allocations.cpp, which replaces the
/// operator.
std::size_t allocations();

}  // namespace wienertree::test
