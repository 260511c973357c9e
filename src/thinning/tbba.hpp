#pragma once
/// TBBA, the tree based branching algorithm: given weights g_1..g_k of sum 1 and N particles, random integers
/// o_i with
///
///     sum o_i = N,   o_i in {[N g_i], [N g_i] + 1},   E o_i = N g_i,   Var o_i = {N g_i} (1 - {N g_i}),
///     Cov(o_i, o_j) <= 0
///
/// where [x] and {x} are the integer and the fractional part, so that the variance is the least possible
/// (Crisan, Lyons 2002, "Minimal entropy approximations and optimal algorithms", Monte Carlo Methods Appl. 8,
/// 343-356; Bain, Crisan 2009, Fundamentals of Stochastic Filtering, section 9.2.1).
///
/// Let G be the mass and H the number of particles that remain before site i, G = H = N at first. H is [G] or
/// [G] + 1; with h = H - [G] the algorithm is a two-state Markov chain with P(h = 1) = {G}. Let r' = {G}
/// before the site, r = {G - N g_i} after it, u uniform:
///
///     r' >= {N g_i}:  h' = 0 stays 0;  h' = 1 stays 1 if u < r / r', else becomes 0;
///     r' <  {N g_i}:  h' = 1 stays 1;  h' = 0 stays 0 if u < (1 - r) / (1 - r'), else becomes 1;
///     o_i = (particles before) - (particles after).
///
/// G is an integer here (see masses.hpp), so r never drifts, the first three properties above hold for every
/// input whatever the rounding of the quotients, and the last site takes exactly what is left.
#include <cstddef>
#include <cstdint>
#include <span>

#include "wienertree/numeric/parallel.hpp"
#include "wienertree/numeric/random.hpp"

namespace wienertree {

/// What remains before a site: mass G in units of 2^-B, and h = H - [G], 0 or 1 (0 if {G} = 0).
struct TbbaRemainder {
  std::uint64_t mass = 0;
  bool extra = false;
};

/// Counts of sites of mass m_i (units of 2^-B), given what remains before the first; `remainder` becomes what
/// remains after the last. Site i uses draw first_draw + i.
/// @pre sum m_i <= remainder.mass < 2^63, count.size() == mass.size()
void tbba(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
          std::uint64_t first_draw, TbbaRemainder& remainder, std::span<std::uint32_t> count);

/// Flat form: all sites, sum m_i = N 2^B. The same counts, bit for bit, for every number of threads: blocks
/// start from h = 0, and a block that should have started from h = 1 differs in one count only, at the first
/// site where the chain forgets h.
void tbba(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
          ThreadPool& threads, std::span<std::uint32_t> count);

/// Iterated form, one level of a tree: child j of parent i, of mass lambda_j times the parent's, stands at
/// j * parents + i. A parent's particles are shared among its children by TBBA with the parent's mass as root
/// mass; families are independent given the parents, and nodes without particles need never be made. Level by
/// level the leaves' counts have each the law they have in the flat form. Jointly they do so if N = 1 or the
/// families are owed whole numbers, not in general: here every inner node, too, receives [N g] or [N g] + 1
/// particles, while the flat form promises that of leaves and of the sets of first leaves alone.
///
/// Below one particle only ratios of masses within the family matter (one child gets the particle), so masses
/// under 1/2 are doubled until they are not: trees of any depth keep all bits.
/// @param parent_count [m] or [m] + 1 each, from the level above; at the root N with mass N 2^B
/// @throws InputError if a parent's count is not one of those, or there are no lambdas
void tbba_level(std::span<const std::uint64_t> parent_mass, std::span<const std::uint32_t> parent_count,
                std::span<const double> lambda, int fraction_bits, const RandomStream& random,
                std::span<std::uint64_t> child_mass, std::span<std::uint32_t> child_count);

}  // namespace wienertree
