#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/convex_parts.hpp"
#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/goal_estimate.hpp"
#include "pushplan/geometry/obstacle_grid.hpp"
#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/geometry/polygon.hpp"
#include "pushplan/geometry/raster.hpp"
#include "pushplan/geometry/regions.hpp"
#include "pushplan/geometry/shadows.hpp"
#include "pushplan/geometry/visibility.hpp"
#include "pushplan/geometry/visibility_search.hpp"

namespace pushplan::bindings {

using namespace nb::literals;

namespace {

using BoxArray = Numbers<4>;
using OnePoint = Numbers<2>;

Vec2 point(const OnePoint& array) { return {array.data()[0], array.data()[1]}; }

Box box(const BoxArray& array) {
  return {array.data()[0], array.data()[1], array.data()[2], array.data()[3]};
}

/// The corners of a polygon that has some.
Polygon corners_of(const Points& polygon) {
  require_room("polygon", polygon.shape(0), 1);
  return points(polygon);
}

/// Bends with their directions.
Bends bends_of(const Points& places, const Points& incoming, const Points& outgoing) {
  require_count("incoming", incoming.shape(0), places.shape(0));
  require_count("outgoing", outgoing.shape(0), places.shape(0));
  return {points(places), points(incoming), points(outgoing)};
}

/// Values of a grid that has some.
ArrayView<const double, 2> field(const Floats<2>& values) {
  require_room("values", values.size(), 1);
  return view(values);
}

/// An array (N, 2) with these numbers.
template <class Number, class Row>
auto pairs(std::vector<Row> values) {
  static_assert(sizeof(Row) == 2 * sizeof(Number));
  auto* owned = new std::vector<Row>(std::move(values));
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
  return nb::ndarray<nb::numpy, Number, nb::shape<-1, 2>>(reinterpret_cast<Number*>(owned->data()),
                                                          {owned->size(), 2}, owner);
}

template <class T>
void def_fill_convex(nb::module_& module) {
  module.def(
      "fill_convex",
      [](const Array<T, 2>& image, const Points& corners, T value) {
        ConvexFiller().fill(view(image), points(corners), value);
      },
      "image"_a.noconvert(), "vertices_px"_a.noconvert(), "value"_a, ReleaseGil());
}

void bind_shapes(nb::module_& module) {
  module.def(
      "convex_penetration",
      [](const Points& a, const Points& b) {
        const Penetration found = convex_penetration(points(a), points(b));
        return std::tuple(found.depth, found.normal.x, found.normal.y);
      },
      "a"_a.noconvert(), "b"_a.noconvert());
  module.def(
      "convex_overlap",
      [](const Points& a, const Points& b) { return convex_overlap(points(a), points(b)); },
      "a"_a.noconvert(), "b"_a.noconvert());
  module.def(
      "convex_distance",
      [](const Points& a, const Points& b) { return convex_distance(points(a), points(b)); },
      "a"_a.noconvert(), "b"_a.noconvert());
  module.def(
      "merge_pieces",
      [](const Points& vertices, const Integers<1>& offsets, double budget) {
        for (const Vec2 corner : points(vertices)) require_finite("vertices", corner.x + corner.y);
        const std::vector<Index> owners = merge_pieces(polygons(vertices, offsets), budget);
        const auto numbers = zeros<Index, 1>({owners.size()});
        std::copy(owners.begin(), owners.end(), view(numbers).begin());
        return numbers;
      },
      "vertices"_a.noconvert(), "offsets"_a.noconvert(), "budget"_a,
      "Merges some convex pieces, of which this returns the number of the convex part of each, so "
      "that the areas of the hulls beyond those of the pieces add up to at most a budget [m^2].");
  module.def(
      "polygon_area", [](const Points& polygon) { return polygon_area(corners_of(polygon)); },
      "polygon"_a.noconvert());
  module.def(
      "polygon_centroid",
      [](const Points& polygon) {
        const Vec2 centre = polygon_centroid(corners_of(polygon));
        return std::tuple(centre.x, centre.y);
      },
      "polygon"_a.noconvert());
  module.def(
      "polygon_inertia", [](const Points& polygon) { return polygon_inertia(corners_of(polygon)); },
      "polygon"_a.noconvert());
  module.def(
      "transform_points",
      [](const OnePose& body, const Points& corners, const PointsOut& out) {
        transform(pose(body), points(corners), points_out(out, corners.shape(0)));
      },
      "pose"_a.noconvert(), "points"_a.noconvert(), "out"_a.noconvert());
  module.def(
      "transform_outlines",
      [](const Poses& bodies, const Points& vertices, const Integers<1>& offsets,
         const PointsOut& out) {
        const Polygons outlines = polygons(vertices, offsets);
        require_count("poses", bodies.shape(0), outlines.count());
        transform(poses(bodies), outlines, points_out(out, vertices.shape(0)));
      },
      "poses"_a.noconvert(), "vertices"_a.noconvert(), "offsets"_a.noconvert(), "out"_a.noconvert(),
      ReleaseGil());
  module.def(
      "arc_step",
      [](const OnePose& from, double distance, double turn) {
        const Pose to = arc_step(pose(from), distance, turn);
        return std::tuple(to.x, to.y, to.theta);
      },
      "pose"_a.noconvert(), "distance"_a, "turn"_a);
  def_fill_convex<std::uint8_t>(module);
  def_fill_convex<float>(module);
  def_fill_convex<double>(module);
  def_fill_convex<bool>(module);
  def_fill_convex<std::int32_t>(module);
  def_fill_convex<std::int64_t>(module);
}

void bind_obstacles(nb::module_& module) {
  nb::class_<Obstacles>(module, "Obstacles", "Convex cores, each with a radius around it.")
      .def(
          "__init__",
          [](Obstacles* self, const Points& vertices, const Integers<1>& offsets,
             const Floats<1>& radii, const Floats<2>& boxes) {
            const Polygons cores = polygons(vertices, offsets);
            require_count("radii", radii.shape(0), cores.count());
            require_count("boxes", boxes.shape(0), cores.count());
            new (self) Obstacles{cores, view(radii), rows_as<const Box>(boxes)};
          },
          "vertices"_a.noconvert(), "offsets"_a.noconvert(), "radii"_a.noconvert(),
          "boxes"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
          nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>())
      .def_prop_ro(
          "vertices",
          [](const Obstacles& self) { return shown<double>(self.cores.vertices, self); },
          "(V, 2) corners of the cores [m], each counter-clockwise; a segment has two.")
      .def_prop_ro(
          "offsets", [](const Obstacles& self) { return shown<Index>(self.cores.offsets, self); },
          "(C + 1,) where each core starts.")
      .def_prop_ro(
          "radii", [](const Obstacles& self) { return shown<double>(self.radii, self); },
          "(C,) how far each obstacle reaches beyond its core [m].")
      .def_prop_ro(
          "boxes", [](const Obstacles& self) { return shown<double>(self.boxes, self); },
          "(C, 4) x_min, y_min, x_max, y_max of each obstacle [m].")
      .def(
          "distance",
          [](const Obstacles& self, double x, double y) { return obstacle_distance({x, y}, self); },
          "x"_a, "y"_a)
      .def(
          "line_of_sight",
          [](const Obstacles& self, double px, double py, double qx, double qy, double margin) {
            return line_of_sight({px, py}, {qx, qy}, self, margin);
          },
          "px"_a, "py"_a, "qx"_a, "qy"_a, "margin"_a)
      .def(
          "free_points",
          [](const Obstacles& self, const Points& places, const BoxArray& bounds, double gap) {
            const auto free = zeros<bool, 1>({places.shape(0)});
            const auto flags = view(free);
            {
              nb::gil_scoped_release release;
              free_points(points(places), self, box(bounds), gap, flags);
            }
            return free;
          },
          "points"_a.noconvert(), "box"_a.noconvert(), "gap"_a,
          "Flags of points that lie in the box (4,) and the gap or more off every obstacle.")
      .def(
          "fill_clearance",
          [](const Obstacles& self, const FloatsOut<2>& out, Index first, Index last,
             const OnePoint& origin, double step) {
            require_between("last", last, 0, view(out).size());
            require_between("first", first, 0, last);
            fill_clearance(view(out), first, last, {point(origin), step}, self);
          },
          "out"_a.noconvert(), "first"_a, "last"_a, "origin"_a.noconvert(), "step"_a, ReleaseGil());
  module.def(
      "core_distance",
      [](double x, double y, const Points& core) { return core_distance({x, y}, points(core)); },
      "x"_a, "y"_a, "core"_a.noconvert());
}

void bind_visibility(nb::module_& module) {
  nb::class_<Regions>(module, "Regions", "A union of discs, half-planes and convex polygons.")
      .def(
          "__init__",
          [](Regions* self, const Floats<2>& discs, const Floats<2>& half_planes,
             const Points& vertices, const Integers<1>& offsets) {
            new (self) Regions{rows_as<const Disc>(discs), rows_as<const HalfPlane>(half_planes),
                               polygons(vertices, offsets)};
          },
          "discs"_a.noconvert(), "half_planes"_a.noconvert(), "vertices"_a.noconvert(),
          "offsets"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
          nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>())
      .def_prop_ro(
          "discs", [](const Regions& self) { return shown<double>(self.discs, self); },
          "(D, 3) x, y, radius [m]; a radius of 0 is a point.")
      .def_prop_ro(
          "half_planes", [](const Regions& self) { return shown<double>(self.half_planes, self); },
          "(H, 4) point x, y [m] and unit normal; what is on or beyond the line belongs to it.")
      .def_prop_ro(
          "vertices",
          [](const Regions& self) { return shown<double>(self.polygons.vertices, self); },
          "(V, 2) corners of convex polygons [m], counter-clockwise; two make a segment.")
      .def_prop_ro(
          "offsets", [](const Regions& self) { return shown<Index>(self.polygons.offsets, self); },
          "(P + 1,) where each polygon starts.")
      .def(
          "nearest",
          [](const Regions& self, Index k, double x, double y) {
            require_index("k", k, self.count());
            const Vec2 nearest = nearest_in_region(k, {x, y}, self);
            return std::tuple(nearest.x, nearest.y);
          },
          "k"_a, "x"_a, "y"_a);
  nb::class_<Bends>(module, "Bends", "Places where a shortest path may bend.")
      .def(
          "__init__",
          [](Bends* self, const Points& places, const Points& incoming, const Points& outgoing) {
            new (self) Bends{bends_of(places, incoming, outgoing)};
          },
          "points"_a.noconvert(), "incoming"_a.noconvert(), "outgoing"_a.noconvert(),
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>());
  nb::class_<Nodes>(module, "Nodes", "Bends and ends of paths, sorted by distance to the goal.")
      .def(
          "__init__",
          [](Nodes* self, const Bends& bends, const Floats<1>& distances) {
            require_count("distances", distances.shape(0), bends.count());
            new (self) Nodes{bends, view(distances)};
          },
          "bends"_a, "distances"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
  nb::class_<GoalScene>(module, "GoalScene", "A goal among obstacles.")
      .def(
          "__init__",
          [](GoalScene* self, const Regions& regions, const Obstacles& obstacles,
             const BoxArray& bounds,
             double gap) { new (self) GoalScene{regions, obstacles, box(bounds), gap}; },
          "regions"_a, "obstacles"_a, "box"_a.noconvert(), "gap"_a, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>())
      .def(
          "goal_leg",
          [](const GoalScene& self, double x, double y) {
            const GoalLeg leg = goal_leg({x, y}, self);
            return std::tuple(leg.length, leg.end.x, leg.end.y);
          },
          "x"_a, "y"_a)
      .def(
          "goal_legs",
          [](const GoalScene& self, const Points& places) {
            const auto legs = zeros<double, 2>({places.shape(0), 3});
            {
              nb::gil_scoped_release release;
              auto* leg = reinterpret_cast<GoalLeg*>(legs.data());
              for (const Vec2 p : points(places)) *leg++ = goal_leg(p, self);
            }
            return legs;
          },
          "points"_a.noconvert(), "(N, 3) `goal_leg` of each point.")
      .def(
          "node_leg",
          [](const GoalScene& self, double x, double y, double limit, Index hint, bool tangent_only,
             const Nodes& nodes) {
            require_between("hint", hint, kNoLeg, nodes.places.count() - 1);
            const NodeLeg leg =
                node_leg({x, y}, limit, hint, tangent_only, nodes, self.obstacles, self.gap);
            return std::tuple(leg.distance, leg.node);
          },
          "x"_a, "y"_a, "limit"_a, "hint"_a, "tangent_only"_a, "nodes"_a, ReleaseGil())
      .def(
          "fill_distances",
          [](const GoalScene& self, const FloatsOut<2>& out, const OnePoint& origin, double step,
             const Nodes& nodes, double sliver) {
            fill_distances(view(out), {point(origin), step}, nodes, self, sliver);
          },
          "out"_a.noconvert(), "origin"_a.noconvert(), "step"_a, "nodes"_a, "sliver"_a,
          ReleaseGil());
  module.def(
      "visible_pairs",
      [](const Bends& bends, const Obstacles& obstacles, double gap) {
        VisiblePairs found;
        {
          nb::gil_scoped_release release;
          found = visible_pairs(bends, obstacles, gap);
        }
        return std::tuple(pairs<Index>(std::move(found.pairs)),
                          copied(std::span<const double>(found.lengths)));
      },
      "bends"_a, "obstacles"_a, "gap"_a);
  module.def(
      "relax",
      [](const Integers<1>& starts, const Integers<1>& ends, const Floats<1>& lengths,
         const FloatsOut<1>& distances, const IntegersOut<1>& parents) {
        const std::size_t count = distances.shape(0);
        require_count("starts", starts.shape(0), count + 1);
        require_count("parents", parents.shape(0), count);
        require_count("lengths", lengths.shape(0), ends.shape(0));
        require_offsets("starts", view(starts), ends.shape(0));
        require_indices("ends", view(ends), static_cast<Index>(count));
        relax({view(starts), view(ends), view(lengths)}, view(distances), view(parents));
      },
      "starts"_a.noconvert(), "ends"_a.noconvert(), "lengths"_a.noconvert(),
      "distances"_a.noconvert(), "parents"_a.noconvert(), ReleaseGil());
  module.def(
      "segment_crossings",
      [](const Floats<2>& first, const Floats<2>& second) {
        return pairs<double>(
            segment_crossings(rows_as<const Segment>(first), rows_as<const Segment>(second)));
      },
      "first"_a.noconvert(), "second"_a.noconvert());
  module.def(
      "find_nearest_marked",
      [](const Array<const bool, 2>& marked, const IntegersOut<2>& rows,
         const IntegersOut<2>& cols) {
        for (const auto& out : {rows, cols}) {
          require_count("rows of the output", out.shape(0), marked.shape(0));
          require_count("columns of the output", out.shape(1), marked.shape(1));
        }
        find_nearest_marked(view(marked), view(rows), view(cols));
      },
      "marked"_a.noconvert(), "rows"_a.noconvert(), "cols"_a.noconvert(), ReleaseGil());
  module.def(
      "sample",
      [](const Floats<2>& values, double ox, double oy, double step, double x, double y) {
        return sample(field(values), {{ox, oy}, step}, {x, y});
      },
      "values"_a.noconvert(), "ox"_a, "oy"_a, "step"_a, "x"_a, "y"_a);
  module.def(
      "sample_points",
      [](const Floats<2>& values, double ox, double oy, double step, const Points& at,
         const FloatsOut<1>& out) {
        require_room("out", out.shape(0), at.shape(0));
        sample(field(values), {{ox, oy}, step}, points(at), view(out));
      },
      "values"_a.noconvert(), "ox"_a, "oy"_a, "step"_a, "points"_a.noconvert(), "out"_a.noconvert(),
      ReleaseGil());
}

void bind_path_search(nb::module_& module) {
  nb::class_<ObstacleGrid>(module, "ObstacleGrid", "The obstacles that reach into each cell.")
      .def(
          "__init__",
          [](ObstacleGrid* self, const Obstacles& obstacles, double margin) {
            for (const Box& box : obstacles.boxes) {
              require_finite("boxes", box.x_max - box.x_min + (box.y_max - box.y_min) + margin);
            }
            new (self) ObstacleGrid(obstacles, margin);
          },
          "obstacles"_a, "margin"_a, nb::keep_alive<1, 2>())
      .def_prop_ro("shape", [](const ObstacleGrid& s) { return std::tuple(s.rows(), s.columns()); })
      .def_prop_ro("cell", &ObstacleGrid::cell)
      .def_prop_ro(
          "first", [](const ObstacleGrid& s) { return copied(s.first()); }, kOwned)
      .def_prop_ro("items", [](const ObstacleGrid& s) { return copied(s.items()); }, kOwned);
  nb::class_<Corners>(module, "Corners", "Corners by obstacle, then ends on the goal's rim.")
      .def(
          "__init__",
          [](Corners* self, const Points& places, const Points& incoming, const Points& outgoing,
             const Integers<1>& owner, const Integers<1>& first, const Points& middles,
             const Points& halves) {
            const std::size_t count = owner.shape(0);
            require_room("points", places.shape(0), count);
            require_count("incoming", incoming.shape(0), count);
            require_count("outgoing", outgoing.shape(0), count);
            require_count("first", first.shape(0), middles.shape(0) + 1);
            require_count("halves", halves.shape(0), middles.shape(0));
            require_offsets("first", view(first), count);
            new (self) Corners{points(places), points(incoming), points(outgoing), view(owner),
                               view(first),    points(middles),  points(halves)};
          },
          "points"_a.noconvert(), "incoming"_a.noconvert(), "outgoing"_a.noconvert(),
          "owner"_a.noconvert(), "first"_a.noconvert(), "middles"_a.noconvert(),
          "halves"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
          nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>());
  nb::class_<CoveredSides>(module, "CoveredSides",
                           "Cells over a map, and which sides between them are covered.")
      .def(
          "__init__",
          [](CoveredSides* self, const Corners& corners, const BoxArray& bounds, double cell) {
            const Box around = box(bounds);
            require_finite("box", around.x_max - around.x_min + (around.y_max - around.y_min));
            require_finite("cell", cell);
            for (const Vec2 corner : corners.points) require_finite("corners", corner.x + corner.y);
            new (self) CoveredSides({corners.points.first(corners.owner.size()), corners.first},
                                    around, cell);
          },
          "corners"_a, "box"_a.noconvert(), "cell"_a, ReleaseGil())
      .def_prop_ro("shape", [](const CoveredSides& s) { return std::tuple(s.rows(), s.columns()); })
      .def_prop_ro("cell", &CoveredSides::cell);
  nb::class_<GoalEstimate>(module, "GoalEstimate", "Estimates of the way to a goal.")
      .def(
          "__init__",
          [](GoalEstimate* self, const CoveredSides& cells, const GoalScene& scene,
             const OnePoint& start) {
            new (self) GoalEstimate(cells, scene.regions, point(start));
          },
          "cells"_a, "scene"_a, "start"_a.noconvert(), nb::keep_alive<1, 2>(), ReleaseGil())
      .def("run", &GoalEstimate::run, "cells"_a, ReleaseGil())
      .def(
          "at", [](const GoalEstimate& s, double x, double y) { return s.from({x, y}); }, "x"_a,
          "y"_a);
  nb::enum_<VisibilitySearch::Outcome>(module, "SearchOutcome")
      .value("FOUND", VisibilitySearch::Outcome::kFound)
      .value("EXHAUSTED", VisibilitySearch::Outcome::kExhausted)
      .value("PAUSED", VisibilitySearch::Outcome::kPaused);
  nb::class_<VisibilitySearch>(module, "VisibilitySearch", "Lazy A* over the visibility graph.")
      .def(
          "__init__",
          [](VisibilitySearch* self, const OnePoint& start, const Corners& corners,
             const GoalScene& scene, const ObstacleGrid& grid, double sliver,
             const GoalEstimate* estimate) {
            require_count("corners", corners.middles.size(), scene.obstacles.count());
            new (self) VisibilitySearch(point(start), corners, scene, grid, sliver, estimate);
          },
          "start"_a.noconvert(), "corners"_a, "scene"_a, "grid"_a, "sliver"_a,
          "estimate"_a = nb::none(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
          nb::keep_alive<1, 5>(), nb::keep_alive<1, 7>(), ReleaseGil())
      .def("run", &VisibilitySearch::run, "budget"_a, ReleaseGil())
      .def(
          "path",
          [](VisibilitySearch& s) {
            const std::vector<Index> nodes = s.path();
            return copied(std::span<const Index>(nodes));
          },
          kOwned);
}

void bind_shadows(nb::module_& module) {
  module.def(
      "fill_shadows",
      [](const Array<std::uint8_t, 2>& mask, double x, double y, const Points& corners,
         const Integers<1>& offsets, std::uint8_t value) {
        ShadowPainter(polygons(corners, offsets)).fill(view(mask), {x, y}, value);
      },
      "mask"_a.noconvert(), "x"_a, "y"_a, "corners"_a.noconvert(), "offsets"_a.noconvert(),
      "value"_a, ReleaseGil());
  module.def(
      "fill_bend_distances",
      [](const Array<float, 3>& table, const OnePoint& origin, double step, const Bends& bends,
         const Floats<2>& between, const Points& corners, const Integers<1>& offsets, double gap) {
        const auto count = static_cast<std::size_t>(bends.count());
        require_count("table", table.shape(2), count);
        require_count("between", between.shape(0), count);
        require_count("between", between.shape(1), count);
        fill_bend_distances(view(table), {point(origin), step}, bends, view(between),
                            polygons(corners, offsets), gap);
      },
      "table"_a.noconvert(), "origin"_a.noconvert(), "step"_a, "bends"_a, "between"_a.noconvert(),
      "corners"_a.noconvert(), "offsets"_a.noconvert(), "gap"_a, ReleaseGil());
  module.def(
      "bends_in_sight",
      [](double x, double y, const Bends& bends, const Obstacles& obstacles, double gap,
         double sliver) {
        BendsInSight found;
        {
          nb::gil_scoped_release release;
          found = bends_in_sight({x, y}, bends, obstacles, gap, sliver);
        }
        return std::tuple(copied(std::span<const Index>(found.bends)),
                          copied(std::span<const double>(found.lengths)));
      },
      "x"_a, "y"_a, "bends"_a, "obstacles"_a, "gap"_a, "sliver"_a);
}

}  // namespace

void bind_geometry(nb::module_& module) {
  bind_shapes(module);
  bind_obstacles(module);
  bind_visibility(module);
  bind_path_search(module);
  bind_shadows(module);
}

}  // namespace pushplan::bindings
