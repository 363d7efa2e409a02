#include "pushplan/envs/water.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace pushplan {
namespace {

double cubed(double value) { return value * (value * value); }

struct GaussPoint {
  double place;   // on [-1, 1]
  double weight;  // times 9
};

/// Gauss-Legendre with three points.
constexpr std::array<GaussPoint, 3> kGauss{
    {{-0.7745966692414834, 5.0}, {0.0, 8.0}, {0.7745966692414834, 5.0}}};

/// Mean of |p|^3 over an edge, over 5: times the cross product of its ends it is the integral over
/// the triangle with the origin, as |r|^3 scales with the third power along rays.
double cubed_distance(Vec2 a, Vec2 b) {
  double total = 0.0;
  for (const GaussPoint& point : kGauss) {
    const double u = 0.5 + 0.5 * point.place;
    total += point.weight / 18.0 * cubed(std::hypot(a.x + u * (b.x - a.x), a.y + u * (b.y - a.y)));
  }
  return total / 5.0;
}

}  // namespace

void flow_shapes(const Polygons& bodies, std::span<FlowShape> out) {
  for (Index k = 0; k < bodies.count(); ++k) {
    const Polygon body = bodies[k];
    FlowShape shape{0.0, 0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < body.size(); ++i) {
      const Vec2 a = body[i];
      const Vec2 b = body[i + 1 < body.size() ? i + 1 : 0];
      const double ex = b.x - a.x;
      const double ey = b.y - a.y;
      const double length = std::hypot(ex, ey);
      // t is measured along the edge from the foot of the perpendicular: its speed of rotation
      // meets the water head on (a plate of half length a about its middle has a^4 / 2)
      const double s = (a.x * ex + a.y * ey) / length;
      const double t = (b.x * ex + b.y * ey) / length;
      const double cross = a.x * b.y - a.y * b.x;
      shape.width += length / std::numbers::pi;
      shape.area += 0.5 * cross;
      shape.edge_rotation += 0.125 * std::abs(t * cubed(std::abs(t)) - s * cubed(std::abs(s)));
      shape.area_rotation += cross * cubed_distance(a, b);
    }
    out[static_cast<std::size_t>(k)] = shape;
  }
}

}  // namespace pushplan
