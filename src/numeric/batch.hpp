#pragma once
/// A batch of nodes: N states of d components as a structure of arrays. Component i of all nodes is
/// contiguous, and components lie `stride` doubles apart, so that a vector field is evaluated over many nodes
/// at once.
#include <cassert>
#include <cstddef>
#include <new>
#include <span>
#include <type_traits>

#include "wienertree/numeric/buffer.hpp"

namespace wienertree {

/// Non-owning view of a (components x nodes) block; T is `double` or `const double`. Any node range is a
/// valid view.
template <class T>
class BasicBatchView {
 public:
  BasicBatchView() = default;
  /// @pre stride >= nodes, or components <= 1
  BasicBatchView(T* data, std::size_t components, std::size_t nodes, std::size_t stride)
      : data_(data), components_(components), nodes_(nodes), stride_(stride) {}
  template <class U>
  requires(std::is_const_v<T>&& std::is_same_v<const U, T>)
      BasicBatchView(const BasicBatchView<U>& other)  // NOLINT: a view of doubles is a view of const doubles
      : BasicBatchView(other.data(), other.components(), other.nodes(), other.stride()) {}

  std::size_t components() const { return components_; }
  std::size_t nodes() const { return nodes_; }
  std::size_t stride() const { return stride_; }
  T* data() const { return data_; }
  /// Component i of every node, contiguous.
  std::span<T> component(std::size_t i) const {
    assert(i < components_);
    return {data_ + i * stride_, nodes_};
  }
  T& operator()(std::size_t i, std::size_t node) const {
    assert(i < components_ && node < nodes_);
    return data_[i * stride_ + node];
  }
  /// Nodes first .. first+count-1.
  BasicBatchView nodes(std::size_t first, std::size_t count) const {
    assert(first + count <= nodes_);
    return {data_ + first, components_, count, stride_};
  }
  /// Components first .. first+count-1.
  BasicBatchView components(std::size_t first, std::size_t count) const {
    assert(first + count <= components_);
    return {data_ + first * stride_, count, nodes_, stride_};
  }

 private:
  T* data_ = nullptr;
  std::size_t components_ = 0, nodes_ = 0, stride_ = 0;
};

using BatchView = BasicBatchView<double>;
using ConstBatchView = BasicBatchView<const double>;

/// Owning batch. `reshape` keeps the memory when it suffices, so that a step of a filter does not allocate.
class Batch {
 public:
  Batch() = default;
  Batch(std::size_t components, std::size_t nodes) { reshape(components, nodes); }
  /// Sets the shape; values are unspecified afterwards.
  void reshape(std::size_t components, std::size_t nodes) {
    components_ = components;
    nodes_ = nodes;
    if (values_.size() < components * nodes) resize_unspecified(values_, components * nodes);
  }
  std::size_t components() const { return components_; }
  std::size_t nodes() const { return nodes_; }
  BatchView view() { return {values_.data(), components_, nodes_, nodes_}; }
  ConstBatchView view() const { return {values_.data(), components_, nodes_, nodes_}; }
  operator BatchView() { return view(); }             // NOLINT: a batch is used as its view
  operator ConstBatchView() const { return view(); }  // NOLINT
  std::span<double> component(std::size_t i) { return view().component(i); }
  std::span<const double> component(std::size_t i) const { return view().component(i); }
  double& operator()(std::size_t i, std::size_t node) { return view()(i, node); }
  double operator()(std::size_t i, std::size_t node) const { return view()(i, node); }
  void swap(Batch& other) noexcept {
    values_.swap(other.values_);
    std::swap(components_, other.components_);
    std::swap(nodes_, other.nodes_);
  }

 private:
  Buffer<double> values_;
  std::size_t components_ = 0, nodes_ = 0;
};

}  // namespace wienertree
