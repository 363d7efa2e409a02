// What a planner asks of a model of interaction, whichever it is.
#pragma once

#include <memory>

#include "pushplan/motion/shortcutting.hpp"
#include "pushplan/motion/turn_on_spot.hpp"
#include "pushplan/planners/push_aware/best_first.hpp"

namespace pushplan {

/// A best-first search that can be taken up again.
class PushSearch {
 public:
  virtual ~PushSearch() = default;
  virtual SearchStatus run(Index budget) = 0;
  /// The node of the tree in the goal.
  virtual Index goal() const = 0;
};

/// Work over paths with the objects carried along. For one thread.
class Pushing {
 public:
  virtual ~Pushing() = default;
  virtual double sweep(SweptPath& path, Index first, Index count, double limit,
                       const PathProblem& problem) = 0;
  virtual double shortcut(SweptPath& path, double cost, const ShortcutDraw& draw,
                          const ShortcutShift& shift, SweptPath& trial,
                          const PathProblem& problem) = 0;
  virtual SpotTurn turn(const PathProblem& problem, const Pose& start,
                        std::span<const Pose> objects, double angle) = 0;
  /// From the root of a planted tree; what it is given has to outlive it.
  virtual std::unique_ptr<PushSearch> search(PushTree& tree, const CostToGo& table,
                                             const Branching& branching, double bound,
                                             const PathProblem& problem) = 0;
};

/// The same over one model.
template <InteractionModel M>
class PushingWith final : public Pushing {
 public:
  explicit PushingWith(M& model) : model_(model) {}

  double sweep(SweptPath& path, Index first, Index count, double limit,
               const PathProblem& problem) override {
    constexpr Index kPatience = std::numeric_limits<Index>::max();
    return sweep_objects(path, first, count, limit, kPatience, problem, model_);
  }
  double shortcut(SweptPath& path, double cost, const ShortcutDraw& draw,
                  const ShortcutShift& shift, SweptPath& trial,
                  const PathProblem& problem) override {
    return pushplan::shortcut(path, cost, draw, shift, trial, problem, model_);
  }
  SpotTurn turn(const PathProblem& problem, const Pose& start, std::span<const Pose> objects,
                double angle) override {
    return turn_freely(problem, model_, start, objects, angle);
  }
  std::unique_ptr<PushSearch> search(PushTree& tree, const CostToGo& table,
                                     const Branching& branching, double bound,
                                     const PathProblem& problem) override {
    return std::make_unique<Search>(
        PushLattice<M>(tree, table, branching, bound, problem, model_), 2 * tree.capacity());
  }

 private:
  class Search final : public PushSearch {
   public:
    Search(PushLattice<M> lattice, Index size) : search_(std::move(lattice), size) {
      search_.start(1);
    }
    SearchStatus run(Index budget) override { return search_.run(budget); }
    Index goal() const override { return search_.goal() >> 1; }

   private:
    AStar<PushLattice<M>> search_;
  };

  M& model_;
};

}  // namespace pushplan
