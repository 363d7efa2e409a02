#include "pushplan/control/mpc/tracking.hpp"

#include <algorithm>
#include <limits>

namespace pushplan::mpc {

PathPlace locate(const ReferencePath& track, Vec2 point, double low, double high) {
  const auto poses = track.poses;
  const auto lengths = track.lengths;
  const std::size_t last = poses.size() - 1;
  double best = std::numeric_limits<double>::infinity();
  PathPlace place{lengths[last], static_cast<Index>(last), 0.0};
  const auto above = std::upper_bound(lengths.begin(), lengths.end(), low) - lengths.begin();
  for (auto i = static_cast<std::size_t>(std::max<Index>(0, above - 1));
       i < last && lengths[i] <= high; ++i) {
    const Pose& a = poses[i];
    const double ex = poses[i + 1].x - a.x;
    const double ey = poses[i + 1].y - a.y;
    const double square = ex * ex + ey * ey;
    double t = 0.0;
    if (square > 1e-18) {
      t = std::min(std::max(((point.x - a.x) * ex + (point.y - a.y) * ey) / square, 0.0), 1.0);
    }
    const double dx = point.x - a.x - t * ex;
    const double dy = point.y - a.y - t * ey;
    const double gap = dx * dx + dy * dy;
    if (gap < best) {
      best = gap;
      place = {lengths[i] + t * (lengths[i + 1] - lengths[i]), static_cast<Index>(i), t};
    }
  }
  const Index end = static_cast<Index>(last);
  if (place.index >= end - 1 && (place.index == end || place.fraction >= 1.0)) {
    const Pose& pose = poses[last];
    const double over =
        (point.x - pose.x) * std::cos(pose.theta) + (point.y - pose.y) * std::sin(pose.theta);
    place = {lengths[last] + std::max(over, 0.0), end, 0.0};
  }
  return place;
}

PathErrors errors(const ReferencePath& track, const Pose& pose, const PathPlace& place) {
  const std::size_t last = track.poses.size() - 1;
  const std::size_t i = std::min(static_cast<std::size_t>(place.index), last);
  double ax = track.poses[i].x;
  double ay = track.poses[i].y;
  double heading = track.poses[i].theta;
  double curvature = 0.0;
  double bulge = 0.0;
  double nx = -std::sin(heading);
  double ny = std::cos(heading);
  if (i < last) {
    const Pose& next = track.poses[i + 1];
    const double ex = next.x - ax;
    const double ey = next.y - ay;
    const double length = std::sqrt(ex * ex + ey * ey);
    const double turn = wrap_angle(next.theta - heading);
    const double fraction = place.fraction;
    if (length > 1e-9) {
      nx = -ey / length;
      ny = ex / length;
      const double slip = wrap_angle(std::atan2(ey, ex) - heading - 0.5 * turn);
      if (std::abs(slip) < 0.1 * std::abs(turn)) {  // an arc; else the corner of a polyline
        curvature = turn / length;
        bulge = -0.5 * turn * length * fraction * (1.0 - fraction);
      }
      ax = ax + fraction * ex;
      ay = ay + fraction * ey;
    }
    heading += fraction * turn;
  }
  const double offset = (pose.x - ax) * nx + (pose.y - ay) * ny - bulge;
  return {offset, wrap_angle(pose.theta - heading), heading, curvature};
}

}  // namespace pushplan::mpc
