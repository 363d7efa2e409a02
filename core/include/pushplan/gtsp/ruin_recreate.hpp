// Annealed ruin and recreate on orders of clusters; every insertion sees every choice of nodes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "pushplan/array.hpp"
#include "pushplan/gtsp/problem.hpp"
#include "pushplan/random.hpp"

namespace pushplan::gtsp {

/// What a round may do.
struct RuinRecreateOptions {
  Index max_removed = 20;  // clusters that a round takes out at most, at most m - 2
  double blink = 0.01;     // fraction of places that an insertion overlooks
  Index reach = 8;         // neighbours that a segment swap tries
};

/// A closed tour: the order of its clusters, and the node of each.
struct ClusterTour {
  std::vector<Index> order;
  std::vector<Index> nodes;
  double cost;
};

/// Simulated annealing by ruin and recreate (Christiaens and Vanden Berghe 2020, "Slack induction
/// by string removals"). The problem's arrays have to outlive the search.
class RuinRecreate {
 public:
  /// Begins with this order, whose first cluster, the root, should be small. No tour is known yet.
  RuinRecreate(const Problem& problem, const RuinRecreateOptions& options, std::vector<Index> order,
               std::uint64_t seed);
  ~RuinRecreate();
  RuinRecreate(const RuinRecreate&) = delete;
  RuinRecreate& operator=(const RuinRecreate&) = delete;

  /// Goes on from this order with its cheapest nodes; the root stays in front.
  void start(std::span<const Index> order);
  /// Goes on from the best tour.
  void start_from_best();
  /// Makes rounds at one temperature; costs within the tolerance count as equal.
  void run(double temperature, double tolerance, Index rounds);
  /// Goes on with another problem of the same clusters: `kept` are the nodes that it has of this
  /// one.
  void narrow(const Problem& problem, std::span<const Index> kept);

  const ClusterTour& current() const { return current_; }
  const ClusterTour& best() const { return best_; }
  /// What tours so far would have cost more by way of each node: the least of it, (N,).
  std::span<const double> least_slack() const { return least_slack_; }
  /// The same, summed over the calls of `run`, (N,).
  std::span<const double> total_slack() const { return total_slack_; }
  std::uint64_t random_state() const { return random_.state(); }

 private:
  struct Workspace;

  void use(const Problem& problem);
  void note_best(double tolerance);

  Problem problem_;
  RuinRecreateOptions options_;
  Xorshift64Star random_;
  ClusterTour current_;
  ClusterTour best_;
  std::vector<double> least_slack_;
  std::vector<double> total_slack_;
  std::unique_ptr<Workspace> work_;
};

}  // namespace pushplan::gtsp
