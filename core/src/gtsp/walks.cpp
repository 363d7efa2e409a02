#include "pushplan/gtsp/walks.hpp"

#include <algorithm>
#include <cstdint>

#include "layers.hpp"

namespace pushplan::gtsp {
namespace {

/// Where an open-addressing table looks for a set and an end first.
std::uint64_t slot_of(Index set, Index end) {
  std::uint64_t key = static_cast<std::uint64_t>(set) * 1000003 + static_cast<std::uint64_t>(end);
  key ^= key >> 29;
  key *= 668265263;
  return key ^ (key >> 17);
}

}  // namespace

void extend_walks(ArrayView<const double, 3> walks, ArrayView<double, 3> longer,
                  ArrayView<const double, 4> blocks, const WalkClusters& clusters, Index low,
                  Index high) {
  const Index count = walks.extent(0);
  const Index memories = walks.extent(1);
  const Index width = walks.extent(2);
  for (Index d = low; d < high; ++d) {
    std::fill_n(&longer(d, 0, 0), memories * width, kInfinity);
    for (Index e = 0; e < count; ++e) {
      for (Index memory = 0; memory < memories; ++memory) {
        const Index renewed = clusters.moves(d, e, memory);
        if (renewed < 0) continue;
        double* out = &longer(d, renewed, 0);
        for (Index j = 0; j < clusters.sizes[at(e)]; ++j) {
          const double value = walks(e, memory, j) - clusters.prices[at(e)];
          if (!(value < kInfinity)) continue;
          const double* arcs = &blocks(e, j, d, 0);
          for (Index i = 0; i < width; ++i) out[i] = std::min(out[i], value + arcs[i]);
        }
      }
    }
  }
}

double read_visits(ArrayView<const double, 4> walks, ArrayView<const double, 2> first,
                   ArrayView<const double, 4> blocks, const WalkClusters& clusters,
                   std::span<Index> visits) {
  const Index count = walks.extent(1);
  const Index memories = walks.extent(2);
  struct State {
    Index cluster = -1;
    Index memory = 0;
    Index node = 0;
  };
  const auto earned = [&](Index arcs, const State& s) {
    return walks(arcs, s.cluster, s.memory, s.node) - clusters.prices[at(s.cluster)];
  };
  std::fill(visits.begin(), visits.end(), Index{0});
  double best = kInfinity;
  State state;
  for (State s{0, 0, 0}; s.cluster < count; ++s.cluster) {
    for (s.memory = 0; s.memory < memories; ++s.memory) {
      for (s.node = 0; s.node < clusters.sizes[at(s.cluster)]; ++s.node) {
        const double x = earned(count - 1, s) + first(s.cluster, s.node);
        if (x < best) {
          best = x;
          state = s;
        }
      }
    }
  }
  if (state.cluster < 0) return best;
  visits[at(state.cluster)] = 1;
  // the first step, by cluster, memory and node, from which the value of the walk can come
  const auto step_back = [&](Index arcs) {
    const double value = walks(arcs, state.cluster, state.memory, state.node);
    for (State s{0, 0, 0}; s.cluster < count; ++s.cluster) {
      for (s.memory = 0; s.memory < memories; ++s.memory) {
        if (clusters.moves(state.cluster, s.cluster, s.memory) != state.memory) continue;
        for (s.node = 0; s.node < clusters.sizes[at(s.cluster)]; ++s.node) {
          if (earned(arcs - 1, s) + blocks(s.cluster, s.node, state.cluster, state.node) == value) {
            return s;
          }
        }
      }
    }
    return State{};
  };
  for (Index arcs = count - 1; arcs > 0; --arcs) {
    const State next = step_back(arcs);
    if (next.cluster < 0) break;
    state = next;
    ++visits[at(state.cluster)];
  }
  return best;
}

Index extend_paths(const PathBounds& bounds, const ConstPaths& paths, Index low, Index high,
                   std::span<Index> slots, const Paths& longer, Index found) {
  const Index count = bounds.within.extent(0);
  const Index memories = bounds.within.extent(1);
  const Index width = bounds.within.extent(2);
  const std::uint64_t mask = slots.size() - 1;
  for (Index p = low; p < high; ++p) {
    const Index set = paths.sets[at(p)];
    const Index c = paths.ends[at(p)] / width;
    const Index v = paths.ends[at(p)] % width;
    for (Index d = 0; d < count; ++d) {
      if ((set >> d) & 1) continue;
      Index free = memories - 1;  // the memory of a walk that the path leaves open
      for (Index j = 0; j < bounds.lists.extent(1); ++j) {
        if ((set >> bounds.lists(d, j)) & 1) free &= ~(Index{1} << j);
      }
      const double* arcs = &bounds.costs(c, v, d, 0);
      const double* hope = &bounds.within(d, free, 0);
      const double rest = paths.rests[at(p)] - bounds.prices[at(d)];
      const Index joined = set | (Index{1} << d);
      for (Index i = 0; i < bounds.sizes[at(d)]; ++i) {
        const double value = paths.values[at(p)] + arcs[i];
        if (!(value + hope[i] + rest < bounds.limit)) continue;
        const Index end = d * width + i;
        std::uint64_t slot = slot_of(joined, end) & mask;
        while (slots[slot] >= 0 &&
               !(longer.sets[at(slots[slot])] == joined && longer.ends[at(slots[slot])] == end)) {
          slot = (slot + 1) & mask;
        }
        if (slots[slot] < 0) {
          if (found >= static_cast<Index>(longer.sets.size())) return -1;
          slots[slot] = found;
          longer.sets[at(found)] = joined;
          longer.ends[at(found)] = end;
          longer.values[at(found)] = value;
          longer.rests[at(found)] = rest;
          longer.parents[at(found)] = p;
          ++found;
        } else if (value < longer.values[at(slots[slot])]) {
          longer.values[at(slots[slot])] = value;
          longer.parents[at(slots[slot])] = p;
        }
      }
    }
  }
  return found;
}

}  // namespace pushplan::gtsp
