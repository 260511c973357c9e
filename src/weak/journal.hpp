#pragma once
/// Where the trees of a weak approximation stand, so that it can be put down and taken up again.
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "wienertree/numeric/state_archive.hpp"
#include "wienertree/weak/weak_approximation.hpp"

namespace wienertree {

/// The estimates of the trees that are done, in the order in which they are grown, and the nodes of the one
/// that is growing. One journal a computation, named in the WeakOptions of all its trees. A computation that
/// begins with what a journal of the same computation held is told what that one knew, and goes on with the
/// same bytes.
class WeakJournal {
 public:
  /// Collects between two steps, that is from `WeakOptions::observe`, or between two trees; gives back before
  /// the first tree. @throws InputError for bytes that are not those of a journal
  void exchange(StateArchive& archive);

  /// The estimate of the next tree, if it is done; else nullptr.
  const WeakEstimate* next();
  /// A tree while it grows: takes up what is known of it, and is collected as long as this lives.
  class Growing {
   public:
    Growing(WeakJournal* journal, std::function<void(StateArchive&)> exchange);
    ~Growing();
    Growing(const Growing&) = delete;
    Growing& operator=(const Growing&) = delete;
    void done(const WeakEstimate& estimate);

   private:
    WeakJournal* journal_;
  };

 private:
  std::vector<WeakEstimate> done_;
  std::size_t told_ = 0;                        ///< of them, to the computation that goes on
  std::string begun_;                           ///< what is known of the tree after them
  std::function<void(StateArchive&)> growing_;  ///< the tree that is growing now
};

}  // namespace wienertree
