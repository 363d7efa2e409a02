#include "pushplan/motion/swept_path.hpp"

#include <algorithm>

namespace pushplan {

SweptPath::SweptPath(std::size_t capacity, std::span<const Pose> objects_at_start)
    : poses(capacity),
      curvatures(capacity),
      lengths(capacity),
      works(capacity),
      width_(objects_at_start.size()),
      rows_(capacity),
      objects_(objects_at_start.begin(), objects_at_start.end()) {}

void SweptPath::put_objects(Index pose, std::span<const Pose> objects) {
  const auto at = static_cast<std::size_t>(pose);
  rows_[at] = rows_[at - 1];
  if (std::ranges::equal(objects, objects_at(pose))) return;
  rows_[at] = objects_.size() / width_;
  objects_.insert(objects_.end(), objects.begin(), objects.end());
}

void SweptPath::begin_at(Index pose, const SweptPath& other) {
  const auto at = static_cast<std::size_t>(pose);
  lengths[at] = other.lengths[at];
  works[at] = other.works[at];
  rows_[at] = 0;
  const auto now = other.objects_at(pose);
  objects_.assign(now.begin(), now.end());
}

void SweptPath::take(const SweptPath& other, Index from) {
  count = other.count;
  for (Index n = from + 1; n < count; ++n) {
    const auto at = static_cast<std::size_t>(n);
    poses[at] = other.poses[at];
    curvatures[at] = other.curvatures[at];
    lengths[at] = other.lengths[at];
    works[at] = other.works[at];
    rows_[at] = rows_[at - 1];
    if (other.rows_[at] != other.rows_[at - 1]) put_objects(n, other.objects_at(n));
  }
  // what was taken before and is not in use any more
  if (objects_.size() > 2 * width_ * poses.size()) *this = copy(poses.size());
}

void SweptPath::append(Index kept, std::span<const Pose> more,
                       std::span<const double> their_curvatures) {
  count = kept;
  const std::size_t whole = static_cast<std::size_t>(kept) + more.size();
  if (whole > capacity()) *this = copy(2 * whole);
  std::ranges::copy(more, poses.begin() + kept);
  std::ranges::copy(their_curvatures, curvatures.begin() + kept);
  count = static_cast<Index>(whole);
}

SweptPath SweptPath::copy(std::size_t room) const {
  const std::size_t used_poses = used().size();
  SweptPath other(std::max(room, used_poses), objects_at(0));
  std::copy_n(poses.begin(), used_poses, other.poses.begin());
  std::copy_n(curvatures.begin(), used_poses, other.curvatures.begin());
  std::copy_n(lengths.begin(), used_poses, other.lengths.begin());
  std::copy_n(works.begin(), used_poses, other.works.begin());
  for (Index n = 1; n < count; ++n) {
    const auto at = static_cast<std::size_t>(n);
    other.rows_[at] = other.rows_[at - 1];
    if (rows_[at] != rows_[at - 1]) other.put_objects(n, objects_at(n));
  }
  other.count = count;
  return other;
}

void lay_out(const Pose& start, std::span<const Arc> arcs, SweptPath& path,
             const PathProblem& problem) {
  path.poses[0] = start;
  path.curvatures[0] = 0.0;
  path.count = sample_arcs(start, arcs, problem.spacing, path.buffer().from(1)) + 1;
  if (problem.goal.has_heading()) return;
  const auto there = std::ranges::find_if(
      path.used(), [&](const Pose& pose) { return problem.goal.contains({pose.x, pose.y}); });
  if (there != path.used().end()) path.count = there - path.used().begin() + 1;
}

}  // namespace pushplan
