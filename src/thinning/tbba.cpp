#include "wienertree/thinning/tbba.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <vector>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/masses.hpp"

namespace wienertree {
namespace {

constexpr std::size_t word = 64;  ///< sites whose chain is run at once, one bit each
constexpr std::size_t lanes = 4;

struct Word {
  std::array<std::uint64_t, word + 1> mass;  ///< G before each site, and after the last
  std::array<double, word> u;
};

// Bit i: what site i does to h.
struct Transitions {
  std::uint64_t keep, set;  ///< neither: h becomes 0
};

constexpr std::array<std::uint64_t, word> bits = [] {
  std::array<std::uint64_t, word> b{};
  for (std::size_t i = 0; i < word; ++i) b[i] = std::uint64_t{1} << i;
  return b;
}();

// x as a double, rounded once, for 0 <= x < 2^63; in operations that vectorise where a conversion does not.
inline double to_double(std::uint64_t x) {
  const double high = std::bit_cast<double>(x >> 32 | 0x4530000000000000) - (0x1.0p84 + 0x1.0p52);
  return high + std::bit_cast<double>((x & 0xffffffff) | 0x4330000000000000);
}

WIENERTREE_CLONES Transitions transitions(const Word& w, std::size_t n, int fraction_bits) {
  const std::uint64_t one = std::uint64_t{1} << fraction_bits, fraction = one - 1;
  std::uint64_t keep = 0, set = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t before = w.mass[i], after = w.mass[i + 1];
    const auto r_before = static_cast<std::int64_t>(before & fraction);
    const auto r = static_cast<std::int64_t>(after & fraction);
    const auto owed = static_cast<std::int64_t>((before - after) & fraction);
    const std::uint64_t borrow = r_before < owed ? ~std::uint64_t{0} : 0;
    // r, or 1 - r if the site borrows
    const auto odds = [&](std::int64_t x) {
      return to_double(((static_cast<std::uint64_t>(x) ^ borrow) - borrow) + (one & borrow));
    };
    const std::uint64_t kept = w.u[i] * odds(r_before) < odds(r) ? ~std::uint64_t{0} : 0;
    keep |= kept & bits[i];
    set |= borrow & ~kept & bits[i];
  }
  return {keep, set};
}

WIENERTREE_CLONES void write_counts(const Word& w, std::size_t n, int fraction_bits, std::uint64_t h_before,
                                    std::uint64_t h_after, std::uint32_t* count) {
  for (std::size_t i = 0; i < n; ++i)
    count[i] = static_cast<std::uint32_t>(((w.mass[i] >> fraction_bits) + (h_before >> i & 1)) -
                                          ((w.mass[i + 1] >> fraction_bits) + (h_after >> i & 1)));
}

// Counts of n <= 64 sites; returns the first that forgets h, or a number >= n. Each site either keeps h or
// sets it to a value known beforehand, so h runs through the sites as a carry runs through an addition:
// generated where it is set to 1, propagated where it is kept.
std::size_t tbba_word(const std::uint64_t* mass, std::size_t n, int fraction_bits, Word& w,
                      TbbaRemainder& remainder, std::uint32_t* count) {
  std::uint64_t left = remainder.mass;
  for (std::size_t i = 0; i < n; ++i) {
    w.mass[i] = left;
    left -= mass[i];
  }
  // Sites of mass 0 fill the last vector: they change neither G nor h.
  const std::size_t full = (n + lanes - 1) / lanes * lanes;
  for (std::size_t i = n; i <= full; ++i) w.mass[i] = left;
  for (std::size_t i = n; i < full; ++i) w.u[i] = 0.5;
  const auto [keep, set] = transitions(w, full, fraction_bits);
  const std::uint64_t h_before = (keep | set) ^ set ^ ((keep | set) + set + std::uint64_t{remainder.extra});
  const std::uint64_t h_after = set | (keep & h_before);
  write_counts(w, n, fraction_bits, h_before, h_after, count);
  remainder = {left, (h_after >> (n - 1) & 1) != 0};
  return static_cast<std::size_t>(std::countr_one(keep));
}

// As tbba(), with uniforms(i, out) for the draws of sites i, i+1, .. Returns the first site that forgets h;
// mass.size() if all keep it.
template <class Uniforms>
std::size_t tbba_run(std::span<const std::uint64_t> mass, int fraction_bits, Uniforms uniforms,
                     TbbaRemainder& remainder, std::span<std::uint32_t> count) {
  Word w;
  std::size_t first_forgetting = mass.size();
  for (std::size_t first = 0; first < mass.size(); first += word) {
    const std::size_t n = std::min(word, mass.size() - first);
    uniforms(first, std::span(w.u.data(), n));
    const std::size_t forgetting =
        tbba_word(mass.data() + first, n, fraction_bits, w, remainder, count.data() + first);
    if (first_forgetting == mass.size() && forgetting < n) first_forgetting = first + forgetting;
  }
  return first_forgetting;
}

auto draws_from(const RandomStream& random, std::uint64_t first_draw) {
  return [&random, first_draw](std::size_t i, std::span<double> u) { random.uniforms(first_draw + i, u); };
}

}  // namespace

void tbba(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
          std::uint64_t first_draw, TbbaRemainder& remainder, std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  tbba_run(mass, fraction_bits, draws_from(random, first_draw), remainder, count);
}

void tbba(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
          ThreadPool& threads, std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  const std::size_t size = word * std::max<std::size_t>(1, mass.size() / (word * 4 * threads.size()) + 1);
  const std::size_t blocks = (mass.size() + size - 1) / size;
  struct Block {
    TbbaRemainder remainder;
    std::size_t forgetting = 0, n = 0;
  };
  std::vector<Block> block(blocks);
  const auto sites = [&](std::size_t b) {
    return mass.subspan(b * size, std::min(size, mass.size() - b * size));
  };
  threads.for_each(blocks, [&](std::size_t b, std::size_t) {
    for (const std::uint64_t m : sites(b)) block[b].remainder.mass += m;
  });
  std::uint64_t remaining = 0;  // before each block, from the end
  for (std::size_t b = blocks; b-- > 0;) block[b].remainder.mass = remaining += block[b].remainder.mass;
  threads.for_each(blocks, [&](std::size_t b, std::size_t) {
    block[b].n = sites(b).size();
    block[b].forgetting = tbba_run(sites(b), fraction_bits, draws_from(random, b * size), block[b].remainder,
                                   count.subspan(b * size, block[b].n));
  });
  bool h = false;
  for (std::size_t b = 0; b < blocks; ++b) {
    const bool forgets = block[b].forgetting < block[b].n;
    if (h && forgets) ++count[b * size + block[b].forgetting];
    h = forgets ? block[b].remainder.extra : h;
  }
}

void tbba_level(std::span<const std::uint64_t> parent_mass, std::span<const std::uint32_t> parent_count,
                std::span<const double> lambda, int fraction_bits, const RandomStream& random,
                std::span<std::uint64_t> child_mass, std::span<std::uint32_t> child_count) {
  const std::size_t parents = parent_mass.size(), children = lambda.size();
  assert(parent_count.size() == parents && child_mass.size() == parents * children &&
         child_count.size() == parents * children);
  if (children == 0) throw InputError("a node has no children", "tbba");
  const std::uint64_t half = std::uint64_t{1} << (fraction_bits - 1);
  const std::size_t families_drawn = std::max<std::size_t>(1, 4 * word / children);
  std::vector<double> u(families_drawn * children);
  std::vector<std::uint64_t> family(children);
  std::vector<std::uint32_t> share(children);
  for (std::size_t i = 0; i < parents; ++i) {
    if (i % families_drawn == 0) random.uniforms(i * children, u);
    const double* const drawn = u.data() + i % families_drawn * children;
    const std::uint64_t whole = parent_mass[i] >> fraction_bits;
    const bool integral = parent_mass[i] == whole << fraction_bits;
    if (parent_count[i] < whole || parent_count[i] > whole + (integral ? 0 : 1))
      throw InputError(
          fmt::format("node {} holds {} particles, which its mass does not allow", i, parent_count[i]),
          "tbba",
          fmt::format("{} + {} 2^-{}", whole, parent_mass[i] - (whole << fraction_bits), fraction_bits));
    split_mass(parent_mass[i], lambda, family);
    TbbaRemainder remainder{parent_mass[i], parent_count[i] > whole};
    const auto copy = [&](std::size_t j, std::span<double> out) {
      std::copy_n(drawn + j, out.size(), out.begin());
    };
    tbba_run(family, fraction_bits, copy, remainder, share);
    for (std::size_t j = 0; j < children; ++j) {
      const int doublings = std::countl_zero(family[j]) - std::countl_zero(half);
      child_mass[j * parents + i] = family[j] == 0 || doublings <= 0 ? family[j] : family[j] << doublings;
      child_count[j * parents + i] = share[j];
    }
  }
}

}  // namespace wienertree
