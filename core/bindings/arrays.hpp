// NumPy arrays seen as views. Arrays are never copied or converted: what has another type, another
// number of dimensions or another layout is a TypeError.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <span>
#include <vector>

#include "pushplan/array.hpp"
#include "pushplan/geometry/pose.hpp"

namespace pushplan::bindings {

namespace nb = nanobind;

template <class T, std::size_t Rank>
using Array = nb::ndarray<T, nb::ndim<Rank>, nb::c_contig, nb::device::cpu>;

template <std::size_t Rank>
using Floats = Array<const double, Rank>;
template <std::size_t Rank>
using Integers = Array<const Index, Rank>;
template <std::size_t Rank>
using FloatsOut = Array<double, Rank>;
template <std::size_t Rank>
using IntegersOut = Array<Index, Rank>;

template <class T, nb::ssize_t... Extents>
auto view(const nb::ndarray<T, nb::shape<Extents...>, nb::c_contig, nb::device::cpu>& array) {
  constexpr std::size_t Rank = sizeof...(Extents);
  if constexpr (Rank == 1) {
    return std::span<T>(array.data(), array.shape(0));
  } else {
    typename ArrayView<T, Rank>::Shape shape;
    for (std::size_t axis = 0; axis < Rank; ++axis) {
      shape[axis] = static_cast<Index>(array.shape(axis));
    }
    return ArrayView<T, Rank>(array.data(), shape);
  }
}

template <class T, nb::ssize_t... Extents>
auto view(const nb::ndarray<nb::numpy, T, nb::shape<Extents...>, nb::c_contig>& made) {
  return view(nb::ndarray<T, nb::shape<Extents...>, nb::c_contig, nb::device::cpu>(made));
}

using Poses = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using PosesOut = nb::ndarray<double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using OnePose = nb::ndarray<const double, nb::shape<3>, nb::c_contig, nb::device::cpu>;

/// Rows of x, y, theta as poses, and of x, y as points: the same numbers in memory.
inline std::span<const Pose> poses(const Poses& array) {
  return {reinterpret_cast<const Pose*>(array.data()), array.shape(0)};
}
inline std::span<Pose> poses(const PosesOut& array) {
  return {reinterpret_cast<Pose*>(array.data()), array.shape(0)};
}
inline std::span<const Vec2> points(const Points& array) {
  return {reinterpret_cast<const Vec2*>(array.data()), array.shape(0)};
}
inline Pose pose(const OnePose& array) {
  return {array.data()[0], array.data()[1], array.data()[2]};
}

/// A NumPy array with a copy of these numbers.
template <class T>
auto copied(std::span<const T> values) {
  auto* owned = new std::vector<T>(values.begin(), values.end());
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owned->data(), {owned->size()}, owner);
}

/// An array that a binding makes and returns.
template <class T, std::size_t Rank>
using NewArray = nb::ndarray<nb::numpy, T, nb::ndim<Rank>, nb::c_contig>;

/// A new NumPy array of zeros.
template <class T, std::size_t Rank>
NewArray<T, Rank> zeros(const std::array<std::size_t, Rank>& shape) {
  std::size_t size = 1;
  for (const std::size_t extent : shape) size *= extent;
  auto* numbers = new T[size]();
  nb::capsule owner(numbers, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return NewArray<T, Rank>(numbers, Rank, shape.data(), owner);
}

/// How a property returns an array that owns its numbers.
inline constexpr auto kOwned = nb::rv_policy::move;

using ReleaseGil = nb::call_guard<nb::gil_scoped_release>;

/// Rows of an array as structures of the same numbers.
template <class T, class Array>
std::span<T> rows_as(const Array& array) {
  return {reinterpret_cast<T*>(array.data()), array.shape(0)};
}

/// A NumPy array with a copy of structures of `Number`, a row for each.
template <class Number, class T>
auto copied_rows(std::span<const T> values) {
  constexpr std::size_t kColumns = sizeof(T) / sizeof(Number);
  const auto* numbers = reinterpret_cast<const Number*>(values.data());
  auto* owned = new std::vector<Number>(numbers, numbers + kColumns * values.size());
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<Number>*>(p); });
  return nb::ndarray<nb::numpy, Number, nb::ndim<2>>(owned->data(), {values.size(), kColumns},
                                                     owner);
}

/// What an object of Python refers to, as an array that keeps the object: structures of `Number`,
/// a row for each, or numbers.
template <class Number, class Row, class Owner>
auto shown(std::span<const Row> rows, const Owner& owner) {
  constexpr std::size_t kColumns = sizeof(Row) / sizeof(Number);
  constexpr std::size_t kRank = kColumns == 1 ? 1 : 2;
  const std::array<std::size_t, 2> shape{rows.size(), kColumns};
  return nb::ndarray<nb::numpy, const Number, nb::ndim<kRank>>(
      reinterpret_cast<const Number*>(rows.data()), kRank, shape.data(), nb::find(owner));
}

/// (N, K, 3) numbers as N rows of K poses.
inline ArrayView<Pose, 2> pose_rows(const FloatsOut<3>& array) {
  return {reinterpret_cast<Pose*>(array.data()),
          {static_cast<Index>(array.shape(0)), static_cast<Index>(array.shape(1))}};
}

void bind_control(nb::module_& module);
void bind_envs(nb::module_& module);
void bind_geometry(nb::module_& module);
void bind_gtsp(nb::module_& module);
void bind_interaction(nb::module_& module);
void bind_learned(nb::module_& module);
void bind_motion(nb::module_& module);
void bind_motion_paths(nb::module_& module);
void bind_observation(nb::module_& module);
void bind_planners(nb::module_& module);
void bind_pushing(nb::module_& module);
void bind_rearrangement(nb::module_& module);
void bind_scenarios(nb::module_& module);
void bind_search(nb::module_& module);

}  // namespace pushplan::bindings
