#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "pushplan/geometry/convex.hpp"
#include "pushplan/geometry/convex_parts.hpp"
#include "pushplan/geometry/distance_field.hpp"
#include "pushplan/geometry/grown_map.hpp"
#include "pushplan/geometry/polygon.hpp"
#include "pushplan/geometry/raster.hpp"
#include "pushplan/geometry/regions.hpp"
#include "pushplan/geometry/shadows.hpp"
#include "pushplan/geometry/shortest_path.hpp"

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

/// Copies of the arrays of some polygons.
auto corners_and_offsets(const Polygons& outlines) {
  return std::tuple(copied_rows<double>(outlines.vertices), copied(outlines.offsets));
}

/// Values of a grid that has some.
ArrayView<const double, 2> field(const Floats<2>& values) {
  require_room("values", values.size(), 1);
  return view(values);
}

template <class T>
void def_fill_convex(nb::module_& module) {
  module.def(
      "fill_convex",
      [](const Array<T, 2>& image, const Points& corners, T value) {
        ConvexFiller().fill(view(image), points(corners), value);
      },
      "image"_a, "vertices_px"_a, "value"_a, ReleaseGil());
}

void bind_shapes(nb::module_& module) {
  module.def(
      "convex_penetration",
      [](const Points& a, const Points& b) {
        const Penetration found = convex_penetration(points(a), points(b));
        return std::tuple(found.depth, found.normal.x, found.normal.y);
      },
      "a"_a, "b"_a);
  module.def(
      "convex_overlap",
      [](const Points& a, const Points& b) { return convex_overlap(points(a), points(b)); }, "a"_a,
      "b"_a);
  module.def(
      "convex_distance",
      [](const Points& a, const Points& b) { return convex_distance(points(a), points(b)); }, "a"_a,
      "b"_a);
  module.def(
      "merge_pieces",
      [](const Points& vertices, const Integers<1>& offsets, double budget) {
        for (const Vec2 corner : points(vertices)) require_finite("vertices", corner.x + corner.y);
        const std::vector<Index> owners = merge_pieces(polygons(vertices, offsets), budget);
        const auto numbers = zeros<Index, 1>({owners.size()});
        std::copy(owners.begin(), owners.end(), view(numbers).begin());
        return numbers;
      },
      "vertices"_a, "offsets"_a, "budget"_a,
      "Merges some convex pieces, of which this returns the number of the convex part of each, so "
      "that the areas of the hulls beyond those of the pieces add up to at most a budget [m^2].");
  module.def(
      "polygon_area", [](const Points& polygon) { return polygon_area(corners_of(polygon)); },
      "polygon"_a);
  module.def(
      "polygon_centroid",
      [](const Points& polygon) {
        const Vec2 centre = polygon_centroid(corners_of(polygon));
        return std::tuple(centre.x, centre.y);
      },
      "polygon"_a);
  module.def(
      "polygon_inertia", [](const Points& polygon) { return polygon_inertia(corners_of(polygon)); },
      "polygon"_a);
  module.def(
      "inscribed_radius", [](const Points& polygon) { return inscribed_radius(points(polygon)); },
      "polygon"_a);
  module.def(
      "least_width", [](const Points& polygon) { return least_width(points(polygon)); },
      "polygon"_a);
  module.def(
      "grown_outlines",
      [](const Points& vertices, const Integers<1>& offsets, const Floats<1>& margins) {
        const Polygons outlines = polygons(vertices, offsets);
        require_count("margins", margins.shape(0), outlines.count());
        OwnPolygons grown;
        Index k = 0;
        for (const double margin : view(margins)) grown.add(grown_outline(outlines[k++], margin));
        return corners_and_offsets(grown.polygons());
      },
      "vertices"_a, "offsets"_a, "margins"_a);
  module.def(
      "transform_points",
      [](const OnePose& body, const Points& corners, const PointsOut& out) {
        transform(pose(body), points(corners), points_out(out, corners.shape(0)));
      },
      "pose"_a, "points"_a, "out"_a);
  module.def(
      "transform_outlines",
      [](const Poses& bodies, const Points& vertices, const Integers<1>& offsets,
         const PointsOut& out) {
        const Polygons outlines = polygons(vertices, offsets);
        require_count("poses", bodies.shape(0), outlines.count());
        transform(poses(bodies), outlines, points_out(out, vertices.shape(0)));
      },
      "poses"_a, "vertices"_a, "offsets"_a, "out"_a, ReleaseGil());
  module.def(
      "arc_step",
      [](const OnePose& from, double distance, double turn) {
        const Pose to = arc_step(pose(from), distance, turn);
        return std::tuple(to.x, to.y, to.theta);
      },
      "pose"_a, "distance"_a, "turn"_a);
  def_fill_convex<std::uint8_t>(module);
  def_fill_convex<float>(module);
  def_fill_convex<double>(module);
  def_fill_convex<bool>(module);
  def_fill_convex<std::int32_t>(module);
  def_fill_convex<std::int64_t>(module);
}

void bind_obstacles(nb::module_& module) {
  nb::class_<Obstacles>(module, "Obstacles", "Convex cores, each with a radius around it.")
      .def_prop_ro(
          "vertices",
          [](const Obstacles& self) { return shown<double>(self.cores.vertices, self); },
          "(V, 2) corners of the cores [m], each counter-clockwise; a segment has two.")
      .def_prop_ro(
          "boxes", [](const Obstacles& self) { return shown<double>(self.boxes, self); },
          "(C, 4) x_min, y_min, x_max, y_max of each obstacle [m].")
      .def(
          "fill_clearance",
          [](const Obstacles& self, const FloatsOut<2>& out, Index first, Index last,
             const OnePoint& origin, double step) {
            require_between("last", last, 0, view(out).size());
            require_between("first", first, 0, last);
            fill_clearance(view(out), first, last, {point(origin), step}, self);
          },
          "out"_a, "first"_a, "last"_a, "origin"_a, "step"_a, ReleaseGil());
  module.def(
      "core_distance",
      [](double x, double y, const Points& core) { return core_distance({x, y}, points(core)); },
      "x"_a, "y"_a, "core"_a);
}

void bind_fields(nb::module_& module) {
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
      "marked"_a, "rows"_a, "cols"_a, ReleaseGil());
  module.def(
      "sample",
      [](const Floats<2>& values, double ox, double oy, double step, double x, double y) {
        return sample(field(values), {{ox, oy}, step}, {x, y});
      },
      "values"_a, "ox"_a, "oy"_a, "step"_a, "x"_a, "y"_a);
  module.def(
      "sample_points",
      [](const Floats<2>& values, double ox, double oy, double step, const Points& at,
         const FloatsOut<1>& out) {
        require_room("out", out.shape(0), at.shape(0));
        sample(field(values), {{ox, oy}, step}, points(at), view(out));
      },
      "values"_a, "ox"_a, "oy"_a, "step"_a, "points"_a, "out"_a, ReleaseGil());
}

/// Requires a clearance with which boxes on a map have a size.
void require_clearance(double clearance) {
  require_not_negative("clearance", clearance);
  require_finite("clearance", 4.0 * clearance);
}

/// A path as Python's `Path` takes it.
auto numbers_of(double length, std::span<const Vec2> points) {
  return std::tuple(length, copied_rows<double>(points));
}

void bind_maps(nb::module_& module) {
  nb::class_<StaticMap>(module, "StaticMap", "What never moves, and what is made of it.")
      .def(
          "__init__",
          [](StaticMap* self, const Points& vertices, const Integers<1>& offsets,
             const Floats<2>& lines, const Floats<1>& radii, const BoxArray& bounds) {
            const auto segments = rows_as<const Segment>(lines);
            require_count("radii", radii.shape(0), segments.size());
            require_all_finite("vertices", vertices);
            require_all_finite("lines", lines);
            require_all_finite("radii", radii);
            const Polygons shapes = polygons(vertices, offsets);
            for (Index k = 0; k < shapes.count(); ++k) {
              const double area = polygon_area(shapes[k]);
              if (!(area > 0.0)) refuse("area of vertices", std::to_string(area), "positive");
            }
            std::vector<Wall> walls;
            for (std::size_t i = 0; i < segments.size(); ++i) {
              require_not_negative("radii", view(radii)[i]);
              walls.push_back({segments[i], view(radii)[i]});
            }
            const Box around = box(bounds);
            require_finite("bounds", around.x_max - around.x_min + (around.y_max - around.y_min));
            if (!(around.x_min < around.x_max && around.y_min < around.y_max)) {
              refuse("bounds", "an empty one", "a box with an area");
            }
            new (self) StaticMap(copy_of(shapes), std::move(walls), around);
          },
          "vertices"_a, "offsets"_a, "lines"_a, "radii"_a, "bounds"_a)
      .def_prop_ro(
          "polygons", [](const StaticMap& s) { return corners_and_offsets(s.polygons()); }, kOwned)
      .def_prop_ro(
          "parts", [](const StaticMap& s) { return corners_and_offsets(s.parts()); }, kOwned,
          "Everything as convex polygons.")
      .def_prop_ro(
          "lines", [](const StaticMap& s) { return copied_rows<double>(s.lines()); }, kOwned,
          "(S, 5) x1, y1, x2, y2 and half the thickness [m].")
      .def(
          "grown",
          [](const StaticMap& self, double clearance) {
            require_clearance(clearance);
            return GrownMap::of(self, clearance);
          },
          "clearance"_a, nb::keep_alive<0, 1>());
  nb::class_<GrownMap>(module, "GrownMap", "A map grown by the clearance of paths.")
      .def_prop_ro("obstacles", &GrownMap::obstacles, nb::keep_alive<0, 1>())
      .def_prop_ro("gap", &GrownMap::gap)
      .def_prop_ro("standoff", &GrownMap::standoff)
      .def_prop_ro("excess", &GrownMap::excess)
      .def_prop_ro(
          "outlines",
          [](GrownMap& self) {
            self.make();
            const auto [vertices, offsets] = self.outlines();
            return std::tuple(shown<double>(vertices, self), shown<Index>(offsets, self));
          },
          "(V, 2) corners of polygons around the obstacles [m], and (C + 1,) where each starts.")
      .def(
          "keeps_clearance",
          [](const GrownMap& self, double x, double y) { return self.keeps_clearance({x, y}); },
          "x"_a, "y"_a)
      .def_prop_ro(
          "bend_count",
          [](GrownMap& self) {
            self.make();
            return self.bend_graph().bends().count();
          },
          ReleaseGil())
      .def(
          "fill_bend_distances",
          [](GrownMap& self, const Array<float, 3>& table, const OnePoint& origin, double step) {
            self.make();
            const BendGraph& graph = self.bend_graph();
            const Index count = graph.bends().count();
            require_count("table", table.shape(2), count);
            const std::vector<double> between = graph.distances();
            fill_bend_distances(view(table), {point(origin), step}, graph.bends(),
                                {between.data(), {count, count}}, self.outlines(), self.gap());
          },
          "table"_a, "origin"_a, "step"_a, ReleaseGil())
      .def(
          "bends_in_sight",
          [](GrownMap& self, double x, double y) {
            self.make();
            const BendsInSight found = bends_in_sight(
                {x, y}, self.bend_graph().bends(), self.obstacles(), self.gap(), self.standoff());
            return std::tuple(copied(std::span<const Index>(found.bends)),
                              copied(std::span<const double>(found.lengths)));
          },
          "x"_a, "y"_a);
  nb::class_<OwnRegions>(module, "Regions", "A union of discs, half-planes and convex polygons.")
      .def(
          "__init__",
          [](OwnRegions* self, const Floats<2>& discs, const Floats<2>& half_planes,
             const Points& vertices, const Integers<1>& offsets) {
            const auto round = rows_as<const Disc>(discs);
            const auto planes = rows_as<const HalfPlane>(half_planes);
            new (self) OwnRegions{{round.begin(), round.end()},
                                  {planes.begin(), planes.end()},
                                  copy_of(polygons(vertices, offsets))};
          },
          "discs"_a, "half_planes"_a, "vertices"_a, "offsets"_a);
  nb::enum_<Estimates>(module, "Estimates")
      .value("WHEN_SLOW", Estimates::kWhenSlow)
      .value("NEVER", Estimates::kNever)
      .value("ALWAYS", Estimates::kAlways);
  nb::class_<ShortestPath>(module, "ShortestPath", "A search for the shortest path of a disc.")
      .def(
          "__init__",
          [](ShortestPath* self, const StaticMap& map, double clearance, const OnePoint& start,
             const OwnRegions& goal, Estimates estimates) {
            require_clearance(clearance);
            require_finite("start", point(start).x + point(start).y);
            new (self) ShortestPath(map, clearance, point(start), goal, estimates);
          },
          "map"_a, "clearance"_a, "start"_a, "goal"_a, "estimates"_a, nb::keep_alive<1, 2>())
      .def("run", &ShortestPath::run, ReleaseGil())
      .def_prop_ro(
          "path", [](const ShortestPath& s) { return numbers_of(s.length(), s.points()); }, kOwned);
  nb::class_<GoalDistances>(module, "GoalDistances", "Distances from all bends to a goal.")
      .def(
          "__init__",
          [](GoalDistances* self, const StaticMap& map, double clearance, const OwnRegions& goal) {
            require_clearance(clearance);
            new (self) GoalDistances(map, clearance, goal);
          },
          "map"_a, "clearance"_a, "goal"_a, nb::keep_alive<1, 2>(), ReleaseGil())
      .def(
          "path_from",
          [](const GoalDistances& self, const OnePoint& start) {
            require_finite("start", point(start).x + point(start).y);
            const Route route = self.path_from(point(start));
            return numbers_of(route.length, route.points);
          },
          "start"_a)
      .def(
          "fill",
          [](const GoalDistances& self, const FloatsOut<2>& out, const OnePoint& origin,
             double step) { self.fill(view(out), {point(origin), step}); },
          "out"_a, "origin"_a, "step"_a, ReleaseGil());
}

}  // namespace

void bind_geometry(nb::module_& module) {
  bind_shapes(module);
  bind_obstacles(module);
  bind_fields(module);
  bind_maps(module);
}

}  // namespace pushplan::bindings
