// Driving arcs and paths with the objects carried along.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "pushplan/interaction/model.hpp"
#include "pushplan/motion/swept_path.hpp"

namespace pushplan {

/// The sum over the objects of mass times path length [kg m].
inline double work_of(std::span<const double> lengths, std::span<const double> inverse_masses) {
  double work = 0.0;
  for (std::size_t k = 0; k < lengths.size(); ++k) work += lengths[k] / inverse_masses[k];
  return work;
}

/// Drives single arcs, with memory for one thread. The model has to outlive it.
template <InteractionModel M>
class ArcRollout {
 public:
  ArcRollout(const PathProblem& problem, M& model)
      : problem_(problem),
        model_(&model),
        checker_(problem.footprint, problem.walls),
        objects_(model.radii().size()),
        moved_(model.radii().size()) {}

  /// The length driven [m] of an arc from a pose, with the objects at some poses: less than the
  /// arc's where it enters the goal, 0 where it is blocked.
  double roll(const Pose& start, std::span<const Pose> objects, const Arc& arc);

  /// The pose that was reached.
  const Pose& end() const { return end_; }
  /// Poses of the objects there.
  std::span<const Pose> objects() const { return objects_; }
  /// Path lengths of the objects along the arc [m].
  std::span<const double> moved() const { return moved_; }

  const PathProblem& problem() const { return problem_; }
  M& model() const { return *model_; }

 private:
  PathProblem problem_;
  M* model_;
  CollisionChecker checker_;
  Pose end_{};
  std::vector<Pose> objects_;
  std::vector<double> moved_;
};

/// The cost of a path that reaches a limit.
inline constexpr double kTooCostly = std::numeric_limits<double>::infinity();

/// The cost [kg m] of the first `count` poses of a path, whose objects, lengths and works are known up
/// to the pose `first` and are filled in from there; `kTooCostly` as soon as it reaches `limit`, or
/// where more than `patience` pairs of objects are tested, as many lie in a heap.
template <InteractionModel M>
double sweep_objects(SweptPath& path, Index first, Index count, double limit, Index patience,
                     const PathProblem& problem, M& model);

// ----------------------------------------------------------------------------

template <InteractionModel M>
double ArcRollout<M>::roll(const Pose& start, std::span<const Pose> objects, const Arc& arc) {
  const auto steps =
      static_cast<Index>(std::ceil(arc.length / step_along(arc.curvature, problem_.spacing)));
  std::copy(objects.begin(), objects.end(), objects_.begin());
  std::fill(moved_.begin(), moved_.end(), 0.0);
  Pose last = start;
  for (Index step = 1; step <= steps; ++step) {
    const double length = arc.length * static_cast<double>(step) / static_cast<double>(steps);
    end_ = along_arc(start, {length, arc.curvature});
    if (!checker_.is_free(end_)) return 0.0;
    if (!model_->advance(last, end_, objects_, moved_)) return 0.0;
    if (problem_.goal.contains({end_.x, end_.y})) return length;
    last = end_;
  }
  return arc.length;
}

template <InteractionModel M>
double sweep_objects(SweptPath& path, Index first, Index count, double limit, Index patience,
                     const PathProblem& problem, M& model) {
  model.reset_tests();
  const double mass = problem.robot_mass;
  const double weight = problem.push_weight;
  const auto known = path.objects_at(first);
  std::vector<Pose> objects(known.begin(), known.end());
  std::vector<double> moved(objects.size());
  for (Index n = first + 1; n < count; ++n) {
    const auto here = static_cast<std::size_t>(n);
    const auto before = here - 1;
    const double dx = path.poses[here].x - path.poses[before].x;
    const double dy = path.poses[here].y - path.poses[before].y;
    const Vec2 middle{path.poses[before].x + 0.5 * dx, path.poses[before].y + 0.5 * dy};
    const double step = std::sqrt(dx * dx + dy * dy) * problem.price.factor(middle);
    path.lengths[here] = path.lengths[before] + step;
    std::fill(moved.begin(), moved.end(), 0.0);
    const bool free = model.advance(path.poses[before], path.poses[here], objects, moved);
    path.put_objects(n, objects);
    path.works[here] = path.works[before] + work_of(moved, model.inverse_masses());
    if (!free) path.lengths[here] += problem.jam_length;
    const bool too_costly = mass * path.lengths[here] + weight * path.works[here] >= limit;
    if (too_costly || model.tests() > patience) return kTooCostly;
  }
  const auto last = static_cast<std::size_t>(count - 1);
  return mass * path.lengths[last] + weight * path.works[last];
}

}  // namespace pushplan
