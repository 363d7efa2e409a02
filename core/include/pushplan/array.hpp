// Views of arrays that somebody else owns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace pushplan {

/// Numbers and indices as arrays hold them.
using Index = std::int64_t;

/// An index as the containers of the standard library take it.
constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// A row-major array of `Rank` dimensions, not owned. `a(i, j)` is an element and `a.row(i)` the
/// part with that first index. Indices are not checked.
template <class T, std::size_t Rank>
class ArrayView {
 public:
  using Shape = std::array<Index, Rank>;

  constexpr ArrayView() = default;
  constexpr ArrayView(T* data, const Shape& shape) : data_(data), shape_(shape) {}

  /// A view that may write, seen as one that only reads.
  template <class U>
    requires std::is_same_v<T, const U>
  constexpr ArrayView(const ArrayView<U, Rank>& other)  // NOLINT: meant to convert
      : data_(other.data()), shape_(other.shape()) {}

  constexpr T* data() const { return data_; }
  constexpr const Shape& shape() const { return shape_; }
  constexpr Index extent(std::size_t axis) const { return shape_[axis]; }
  constexpr Index size() const {
    Index product = 1;
    for (const Index extent : shape_) product *= extent;
    return product;
  }

  template <class... Indices>
    requires(sizeof...(Indices) == Rank)
  constexpr T& operator()(Indices... indices) const {
    Index offset = 0;
    std::size_t axis = 0;
    ((offset = offset * shape_[axis++] + static_cast<Index>(indices)), ...);
    return data_[offset];
  }

  /// The part with this first index: a view of one dimension less, or a span.
  constexpr auto row(Index i) const {
    if constexpr (Rank == 2) {
      return std::span<T>(data_ + i * shape_[1], static_cast<std::size_t>(shape_[1]));
    } else {
      typename ArrayView<T, Rank - 1>::Shape rest;
      Index stride = 1;
      for (std::size_t axis = 1; axis < Rank; ++axis) {
        rest[axis - 1] = shape_[axis];
        stride *= shape_[axis];
      }
      return ArrayView<T, Rank - 1>(data_ + i * stride, rest);
    }
  }

 private:
  T* data_ = nullptr;
  Shape shape_{};
};

}  // namespace pushplan
