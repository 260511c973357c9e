#pragma once
/// The memory that a computation may take. It is estimated before it is taken, so that a run that cannot be is refused
/// with what it would need, rather than ended by the system.
#include <string>

namespace wienertree {

/// The limit of this process in bytes: what was set, or three quarters of what the machine had free (MemAvailable of
/// /proc/meminfo, and what the control group and `ulimit` leave) when this was first called.
double memory_limit();
/// Takes effect for what is estimated from then on. @throws InputError unless positive and finite
void set_memory_limit(double bytes);

/// "3.2 GB", "640 MB"
std::string bytes_text(double bytes);

/// `what` needs `bytes`, about. @throws InputError at `where`, if that is over memory_limit()
void require_memory(double bytes, const std::string& what, const std::string& where);
/// The same with a limit of its own.
void require_memory(double bytes, double limit, const std::string& what, const std::string& where);

}  // namespace wienertree
