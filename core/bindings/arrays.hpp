// NumPy arrays seen as views. Arrays are never copied or converted: what has another type, another
// number of dimensions or another layout is a TypeError. The core trusts lengths and indices, so a
// binding that gets several arrays checks them against each other (`require_...`).
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pushplan/array.hpp"
#include "pushplan/geometry/pose.hpp"

namespace pushplan::bindings {

namespace nb = nanobind;

/// An array of NumPy as it is, whatever other arguments are converted to.
template <class T, class Shape>
struct Exact : nb::ndarray<T, Shape, nb::c_contig, nb::device::cpu> {
  using Plain = nb::ndarray<T, Shape, nb::c_contig, nb::device::cpu>;

  Exact() = default;
  explicit Exact(Plain array) : Plain(std::move(array)) {}
};

template <class T, std::size_t Rank>
using Array = Exact<T, nb::ndim<Rank>>;

template <std::size_t Rank>
using Floats = Array<const double, Rank>;
template <std::size_t Rank>
using Integers = Array<const Index, Rank>;
template <std::size_t Rank>
using FloatsOut = Array<double, Rank>;
template <std::size_t Rank>
using IntegersOut = Array<Index, Rank>;

/// Refuses an argument that breaks a rule: an `InvalidInputError` of Python, which is a ValueError.
[[noreturn]] inline void refuse(const char* name, const std::string& value,
                                const std::string& rule) {
  throw std::invalid_argument(std::string(name) + " must be " + rule + ", got " + value);
}

/// Requires an array to have exactly so many elements, rows or columns.
inline void require_count(const char* name, std::size_t count, std::size_t wanted) {
  if (count != wanted) refuse(name, std::to_string(count), std::to_string(wanted) + " in number");
}
inline void require_count(const char* name, std::size_t count, Index wanted) {
  require_count(name, count, static_cast<std::size_t>(wanted));
}

/// Requires an array to have room for so many.
inline void require_room(const char* name, std::size_t count, std::size_t least) {
  if (count < least) {
    refuse(name, std::to_string(count), "at least " + std::to_string(least) + " in number");
  }
}

/// Requires a whole number from `first` to `last`.
inline void require_between(const char* name, Index value, Index first, Index last) {
  if (value < first || value > last) {
    refuse(name, std::to_string(value),
           "from " + std::to_string(first) + " to " + std::to_string(last));
  }
}

/// Requires the number of one of `count` things.
inline void require_index(const char* name, Index value, Index count) {
  if (value < 0 || value >= count) {
    refuse(name, std::to_string(value), "at least 0 and less than " + std::to_string(count));
  }
}
inline void require_indices(const char* name, std::span<const Index> values, Index count) {
  for (const Index value : values) require_index(name, value, count);
}

/// Requires a number that is finite, or also at least 0.
inline void require_finite(const char* name, double value) {
  if (!std::isfinite(value)) refuse(name, std::to_string(value), "finite");
}
template <class Array>
void require_all_finite(const char* name, const Array& numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) require_finite(name, numbers.data()[i]);
}
inline void require_not_negative(const char* name, double value) {
  if (!(value >= 0.0)) refuse(name, std::to_string(value), "0 or more");
}

/// Requires offsets into `count` things: one more than there are parts, which never go back.
inline void require_offsets(const char* name, std::span<const Index> offsets, std::size_t count,
                            Index least = 0) {
  require_room(name, offsets.size(), 1);
  require_between(name, offsets[0], 0, static_cast<Index>(count));
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    require_between(name, offsets[i], offsets[i - 1] + least, static_cast<Index>(count));
  }
}

template <class T, nb::ssize_t... Extents>
auto view(const nb::ndarray<T, nb::shape<Extents...>, nb::c_contig, nb::device::cpu>& array) {
  constexpr std::size_t Rank = sizeof...(Extents);
  if constexpr (Rank == 1) {
    return std::span<T>(array.data(), array.shape(0));
  } else {
    typename ArrayView<T, Rank>::Shape shape;
    for (std::size_t axis = 0; axis < Rank; ++axis)
      shape[axis] = static_cast<Index>(array.shape(axis));
    return ArrayView<T, Rank>(array.data(), shape);
  }
}

template <class T, nb::ssize_t... Extents>
auto view(const nb::ndarray<nb::numpy, T, nb::shape<Extents...>, nb::c_contig>& made) {
  return view(nb::ndarray<T, nb::shape<Extents...>, nb::c_contig, nb::device::cpu>(made));
}

using Poses = Exact<const double, nb::shape<-1, 3>>;
using PosesOut = Exact<double, nb::shape<-1, 3>>;
using Points = Exact<const double, nb::shape<-1, 2>>;
using PointsOut = Exact<double, nb::shape<-1, 2>>;
/// So many numbers.
template <nb::ssize_t Count>
using Numbers = Exact<const double, nb::shape<Count>>;
template <nb::ssize_t Count>
using NumbersOut = Exact<double, nb::shape<Count>>;
using OnePose = Numbers<3>;
using OnePoseOut = NumbersOut<3>;

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
/// Points to write to, at least so many.
inline Vec2* points_out(const PointsOut& array, std::size_t least) {
  require_room("out", array.shape(0), least);
  return reinterpret_cast<Vec2*>(array.data());
}
/// Polygons of at least one corner each.
inline Polygons polygons(const Points& vertices, const Integers<1>& offsets) {
  const Polygons made{points(vertices), {offsets.data(), offsets.shape(0)}};
  require_offsets("offsets", made.offsets, made.vertices.size(), 1);
  return made;
}
inline Compounds compounds(const Points& vertices, const Integers<1>& offsets,
                           const Integers<1>& first) {
  const Compounds made{polygons(vertices, offsets), {first.data(), first.shape(0)}};
  require_offsets("first_parts", made.first, static_cast<std::size_t>(made.parts.count()), 1);
  return made;
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

/// Requires the last dimensions of an array, from `axis` on, to make up structures.
template <class T, class Array>
void require_structures(const Array& array, std::size_t axis) {
  std::size_t bytes = array.itemsize();
  for (; axis < array.ndim(); ++axis) bytes *= array.shape(axis);
  require_count("columns", bytes / array.itemsize(), sizeof(T) / array.itemsize());
}

/// Rows of an array as structures of the same numbers.
template <class T, class Array>
std::span<T> rows_as(const Array& array) {
  require_structures<T>(array, 1);
  return {reinterpret_cast<T*>(array.data()), array.shape(0)};
}

/// (N, K, columns) numbers as N rows of K structures.
template <class T, class Array>
ArrayView<T, 2> grid_as(const Array& array) {
  require_structures<T>(array, 2);
  return {reinterpret_cast<T*>(array.data()),
          {static_cast<Index>(array.shape(0)), static_cast<Index>(array.shape(1))}};
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

void bind_control(nb::module_& module);
void bind_envs(nb::module_& module);
void bind_geometry(nb::module_& module);
void bind_gtsp(nb::module_& module);
void bind_interaction(nb::module_& module);
void bind_motion(nb::module_& module);
void bind_motion_paths(nb::module_& module);
void bind_navigation(nb::module_& module);
void bind_observation(nb::module_& module);
void bind_perception(nb::module_& module);
void bind_planners(nb::module_& module);
void bind_pushing(nb::module_& module);
void bind_rearrangement(nb::module_& module);
void bind_scenarios(nb::module_& module);
void bind_search(nb::module_& module);

}  // namespace pushplan::bindings

/// Reads the arrays of `Exact`.
template <class T, class Shape>
struct nanobind::detail::type_caster<pushplan::bindings::Exact<T, Shape>> {
  using Array = pushplan::bindings::Exact<T, Shape>;
  using PlainCaster = make_caster<typename Array::Plain>;
  NB_TYPE_CASTER(Array, PlainCaster::Name)

  bool from_python(handle source, std::uint32_t flags, cleanup_list* cleanup) noexcept {
    PlainCaster plain;
    const std::uint32_t exact = flags & ~static_cast<std::uint32_t>(cast_flags::convert);
    if (!plain.from_python(source, exact, cleanup)) return false;
    value = Array(std::move(plain.value));
    return true;
  }
};
