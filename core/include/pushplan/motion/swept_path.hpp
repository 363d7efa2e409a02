// A path with the objects that it sweeps.
#pragma once

#include <span>
#include <vector>

#include "pushplan/motion/path_problem.hpp"

namespace pushplan {

/// A path of up to `capacity` poses, in use up to `count`, and where the K objects are at each. Poses
/// at which nothing has moved share them, so that objects at rest cost neither time nor memory.
class SweptPath {
 public:
  SweptPath(std::size_t capacity, std::span<const Pose> objects_at_start);

  std::size_t capacity() const { return poses.size(); }
  PathBuffer buffer() { return {poses, curvatures}; }
  std::span<const Pose> used() const {
    return std::span(poses).first(static_cast<std::size_t>(count));
  }
  /// The objects when the robot is at a pose.
  std::span<const Pose> objects_at(Index pose) const {
    return std::span(objects_).subspan(rows_[static_cast<std::size_t>(pose)] * width_, width_);
  }
  /// Sets them, those at the pose before being known.
  void put_objects(Index pose, std::span<const Pose> objects);
  /// Begins anew with what is known of another path at a pose.
  void begin_at(Index pose, const SweptPath& other);
  /// Takes over another path after the pose `from`, up to which both are alike.
  void take(const SweptPath& other, Index from);
  /// Puts poses in the place of all after the first `kept`; their objects are not known.
  void append(Index kept, std::span<const Pose> more, std::span<const double> their_curvatures);
  /// A copy with room for so many poses at least.
  SweptPath copy(std::size_t room) const;

  std::vector<Pose> poses;
  std::vector<double> curvatures;  // of the arc that leads to each pose [1/m]
  std::vector<double> lengths;     // path length so far, at its price [m]
  std::vector<double> works;       // interaction work so far [kg m]
  Index count = 0;

 private:
  std::size_t width_;              // K
  std::vector<std::size_t> rows_;  // of the objects at each pose
  std::vector<Pose> objects_;      // (R, K)
};

/// Lays the poses of arcs into a path, up to the goal, but all of them where that has a heading.
void lay_out(const Pose& start, std::span<const Arc> arcs, SweptPath& path,
             const PathProblem& problem);

}  // namespace pushplan
