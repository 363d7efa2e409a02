#include "pushplan/geometry/static_map.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pushplan {
namespace {

Box joined(const Box& a, const Box& b) {
  return {std::min(a.x_min, b.x_min), std::min(a.y_min, b.y_min), std::max(a.x_max, b.x_max),
          std::max(a.y_max, b.y_max)};
}

/// An order in which groups of polygons lie near each other, as in a packed R-tree: vertical
/// slices, each sorted along y (Leutenegger, Lopez and Edgington, "STR: a simple and efficient
/// algorithm for R-tree packing", 1997).
std::vector<Index> packed_order(Polygons polygons) {
  std::vector<Index> order(static_cast<std::size_t>(polygons.count()));
  std::iota(order.begin(), order.end(), Index{0});
  constexpr std::size_t kGroup = ConvexObstacles::kGroup;
  if (order.size() <= kGroup) return order;
  const auto x = [&](Index k) { return polygons[k].empty() ? 0.0 : polygons[k][0].x; };
  const auto y = [&](Index k) { return polygons[k].empty() ? 0.0 : polygons[k][0].y; };
  std::ranges::stable_sort(order, {}, x);
  const double count = static_cast<double>(order.size());
  const double slices = std::ceil(std::sqrt(count / static_cast<double>(kGroup)));
  const auto groups = std::ceil(count / (slices * static_cast<double>(kGroup)));
  const std::size_t size = kGroup * static_cast<std::size_t>(groups);
  for (std::size_t first = 0; first < order.size(); first += size) {
    const auto slice = std::span(order).subspan(first, std::min(size, order.size() - first));
    std::ranges::stable_sort(slice, {}, y);
  }
  return order;
}

}  // namespace

OwnObstacles::OwnObstacles(Polygons polygons, const Box& bounds) : bounds_(bounds) {
  shapes_.vertices.reserve(polygons.vertices.size());
  for (const Index k : packed_order(polygons)) {
    shapes_.add(polygons[k]);
    const Box box = box_around(polygons[k]);
    if (boxes_.size() % ConvexObstacles::kGroup == 0) groups_.push_back(box);
    groups_.back() = joined(groups_.back(), box);
    boxes_.push_back(box);
  }
}

StaticMap::StaticMap(OwnPolygons polygons, std::vector<Wall> lines, const Box& bounds)
    : cores_(std::move(polygons)),
      polygon_count_(cores_.offsets.size() - 1),
      lines_(std::move(lines)),
      bounds_(bounds),
      parts_(parts_of(cores_, lines_, bounds)),
      walls_(parts_.polygons(), bounds) {
  for (const Wall& wall : lines_) cores_.add(std::array{wall.line.from, wall.line.to});
  for (Index k = 0; k < parts().count(); ++k) boxes_.push_back(box_around(parts()[k]));
}

Outline capsule(const Wall& wall) {
  const auto& [from, to] = wall.line;
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const double heading = dx == 0.0 && dy == 0.0 ? 0.0 : std::atan2(dy, dx);
  // corners of a circumscribed circle lie between its points of tangency
  constexpr int kCapCorners = 9;  // at each end
  constexpr double kStep = std::numbers::pi / kCapCorners;
  const double reach = wall.radius / std::cos(0.5 * kStep);
  Outline corners(2 * kCapCorners);
  for (int i = 0; i < kCapCorners; ++i) {
    const double angle = heading - 0.5 * std::numbers::pi + kStep * (i + 0.5);
    const Vec2 out{reach * std::cos(angle), reach * std::sin(angle)};
    const auto at = static_cast<std::size_t>(i);
    corners[at] = {to.x + out.x, to.y + out.y};
    corners[at + kCapCorners] = {from.x - out.x, from.y - out.y};
  }
  return corners;
}

OwnPolygons StaticMap::parts_of(const OwnPolygons& polygons, std::span<const Wall> lines,
                                const Box& bounds) {
  OwnPolygons parts = polygons;
  const double thin = 5e-7 * std::max(bounds.x_max - bounds.x_min, bounds.y_max - bounds.y_min);
  for (const auto& [line, radius] : lines) parts.add(capsule({line, std::max(radius, thin)}));
  return parts;
}

std::shared_ptr<void> StaticMap::kept_as(std::type_index kind, std::vector<double> key,
                                         const std::function<std::shared_ptr<void>()>& make,
                                         std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const auto same = [&](const Kept& one) { return one.kind == kind && one.key == key; };
  const auto found = std::ranges::find_if(kept_, same);
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front().made;
  }
  kept_.push_front({kind, std::move(key), make()});
  std::size_t alike = 0;
  std::erase_if(kept_, [&](const Kept& one) { return one.kind == kind && ++alike > most; });
  return kept_.front().made;
}

}  // namespace pushplan
