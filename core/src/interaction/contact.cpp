#include "pushplan/interaction/contact.hpp"

#include <algorithm>
#include <cmath>

namespace pushplan {
namespace {

constexpr double kBelowZero = -5e-324;  // the greatest number less than 0

std::size_t next(Polygon polygon, std::size_t i) { return i + 1 < polygon.size() ? i + 1 : 0; }

/// Clips the edge of `incident` that faces an edge of `reference` against that edge.
Contacts clip_facing(Polygon reference, Index edge, Polygon incident,
                     double sign,    // factor on the edge's outward normal
                     double widest,  // gap up to which a point counts [m]
                     bool beside) {  // a facing edge that lies beside the reference edge counts
  const Vec2 p = reference[static_cast<std::size_t>(edge)];
  const Vec2 q = reference[next(reference, static_cast<std::size_t>(edge))];
  double tx = q.x - p.x;
  double ty = q.y - p.y;
  const double length = std::sqrt(tx * tx + ty * ty);
  tx = tx / length;
  ty = ty / length;
  const double nx = ty;
  const double ny = -tx;
  std::size_t side = 0;
  std::size_t other = 0;
  double facing = kInfinity;
  for (std::size_t i = 0; i < incident.size(); ++i) {
    const std::size_t j = next(incident, i);
    const double ex = incident[j].y - incident[i].y;
    const double ey = incident[i].x - incident[j].x;
    const double d = (ex * nx + ey * ny) / std::sqrt(ex * ex + ey * ey);
    if (d < facing) {
      facing = d;
      side = i;
      other = j;
    }
  }
  // the ends of the facing edge, along the reference edge and along its normal
  const Vec2 u{incident[side].x - p.x, incident[side].y - p.y};
  const Vec2 w{incident[other].x - p.x, incident[other].y - p.y};
  const double along_u = u.x * tx + u.y * ty;
  const double along_w = w.x * tx + w.y * ty;
  const double gap_u = u.x * nx + u.y * ny;
  const double gap_w = w.x * nx + w.y * ny;
  const double span = along_w - along_u;
  Contacts found;
  for (const auto& [along, gap] : {std::pair{along_u, gap_u}, std::pair{along_w, gap_w}}) {
    double d = gap;
    const double clipped = std::min(std::max(along, 0.0), length);
    if (clipped != along) {
      if (std::abs(span) < 1e-12 * length) continue;
      const double fraction = (clipped - along_u) / span;
      if (!beside && (fraction < 0.0 || fraction > 1.0)) continue;
      d = gap_u + fraction * (gap_w - gap_u);
    }
    if (d <= widest) {
      found.points[static_cast<std::size_t>(found.count++)] = {
          {p.x + clipped * tx + d * nx, p.y + clipped * ty + d * ny}, {sign * nx, sign * ny}, d};
    }
  }
  return found;
}

/// Clips against the polygon whose edge separates better. A small preference for the first one
/// keeps the choice from flickering on ties.
Contacts clip_wider(Polygon a, Polygon b, std::pair<double, Index> gap_a,
                    std::pair<double, Index> gap_b, double widest, bool beside) {
  if (gap_b.first > gap_a.first + 1e-9 + 0.01 * std::abs(gap_a.first)) {
    return clip_facing(b, gap_b.second, a, -1.0, widest, beside);
  }
  return clip_facing(a, gap_a.second, b, 1.0, widest, beside);
}

/// The widest gap from an edge of `a` to `b`, and that edge; ends at one beyond `enough`.
std::pair<double, Index> widest_gap(Polygon a, Polygon b, double enough) {
  double best = -kInfinity;
  std::size_t edge = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = next(a, i);
    const double nx = a[j].y - a[i].y;
    const double ny = a[i].x - a[j].x;
    const double scale = 1.0 / std::sqrt(nx * nx + ny * ny);
    double gap = kInfinity;
    for (const Vec2 corner : b) {
      const double d = (corner.x - a[i].x) * nx + (corner.y - a[i].y) * ny;
      if (d < gap) gap = d;
    }
    gap *= scale;
    if (gap > best) {
      best = gap;
      edge = i;
      if (best > enough) break;
    }
  }
  return {best, static_cast<Index>(edge)};
}

}  // namespace

std::pair<double, Index> least_overlap(Polygon a, Polygon b) {
  double best = -kInfinity;
  std::size_t edge = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::size_t j = next(a, i);
    double nx = a[j].y - a[i].y;
    double ny = a[i].x - a[j].x;
    const double scale = 1.0 / std::sqrt(nx * nx + ny * ny);
    nx *= scale;
    ny *= scale;
    double gap = kInfinity;
    for (const Vec2 corner : b) {
      const double d = (corner.x - a[i].x) * nx + (corner.y - a[i].y) * ny;
      if (d < gap) gap = d;
    }
    if (gap > best) {
      best = gap;
      edge = i;
      if (best > 0.0) break;
    }
  }
  return {best, static_cast<Index>(edge)};
}

Contacts contacts(Polygon a, Polygon b) {
  const auto gap_a = least_overlap(a, b);
  if (gap_a.first >= 0.0) return {};
  const auto gap_b = least_overlap(b, a);
  if (gap_b.first >= 0.0) return {};
  return clip_wider(a, b, gap_a, gap_b, kBelowZero, true);
}

Contacts near_contacts(Polygon a, Polygon b, double margin) {
  const auto gap_a = widest_gap(a, b, margin);
  if (gap_a.first > margin) return {};
  const auto gap_b = widest_gap(b, a, margin);
  if (gap_b.first > margin) return {};
  return clip_wider(a, b, gap_a, gap_b, margin, false);
}

}  // namespace pushplan
