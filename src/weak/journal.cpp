#include "wienertree/weak/journal.hpp"

#include <utility>

namespace wienertree {

void exchange(StateArchive& archive, WeakEstimate& estimate) {
  archive(estimate.value, estimate.carriers, estimate.leaves, estimate.ode_solves, estimate.discarded);
}

void WeakJournal::exchange(StateArchive& archive) {
  if (!archive.reading() && growing_) {
    StateArchive tree;
    growing_(tree);
    begun_ = tree.bytes();
  }
  archive(done_, begun_);
}

const WeakEstimate* WeakJournal::next() { return told_ < done_.size() ? &done_[told_++] : nullptr; }

WeakJournal::Growing::Growing(WeakJournal* journal, std::function<void(StateArchive&)> exchange)
    : journal_(journal) {
  if (!journal) return;
  if (!journal->begun_.empty()) {
    StateArchive archive(journal->begun_);
    exchange(archive);
    archive.finish();
  }
  journal->growing_ = std::move(exchange);
}

WeakJournal::Growing::~Growing() {
  if (journal_) journal_->growing_ = nullptr;
}

void WeakJournal::Growing::done(const WeakEstimate& estimate) {
  if (!journal_) return;
  journal_->begun_.clear();
  journal_->done_.push_back(estimate);
  ++journal_->told_;
}

}  // namespace wienertree
