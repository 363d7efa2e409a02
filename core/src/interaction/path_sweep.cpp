#include "pushplan/interaction/path_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pushplan {
namespace {

/// Some of the floes, in memory of their own.
class ChosenFloes {
 public:
  ChosenFloes(const IceBodies& all, std::span<const Index> chosen) {
    offsets_.push_back(0);
    first_.push_back(0);
    for (const Index k : chosen) {
      for (Index p = all.floes.begin(k); p < all.floes.end(k); ++p) {
        const Polygon part = all.floes.parts[p];
        vertices_.insert(vertices_.end(), part.begin(), part.end());
        offsets_.push_back(static_cast<Index>(vertices_.size()));
      }
      first_.push_back(static_cast<Index>(offsets_.size()) - 1);
      radii_.push_back(all.radii[at(k)]);
      masses_.push_back(all.masses[at(k)]);
      inverse_gyration_.push_back(all.inverse_gyration[at(k)]);
    }
    const Compounds floes{{vertices_, offsets_}, first_};
    bodies = {all.hull, all.hull_radius, floes, radii_, masses_, inverse_gyration_};
  }
  ChosenFloes(const ChosenFloes&) = delete;
  ChosenFloes& operator=(const ChosenFloes&) = delete;

  IceBodies bodies;

 private:
  std::vector<Vec2> vertices_;
  std::vector<Index> offsets_;
  std::vector<Index> first_;
  std::vector<double> radii_;
  std::vector<double> masses_;
  std::vector<double> inverse_gyration_;
};

/// The floes whose discs come within some distance of a path.
std::vector<Index> floes_near(std::span<const Pose> path, std::span<const Pose> poses,
                              const IceBodies& bodies, double margin) {
  const Pose& middle = path[path.size() / 2];
  double farthest = -std::numeric_limits<double>::infinity();  // square [m^2]
  for (const Pose& pose : path) {
    const double dx = pose.x - middle.x;
    const double dy = pose.y - middle.y;
    farthest = std::max(farthest, dx * dx + dy * dy);
  }
  const double reach = std::sqrt(farthest) + bodies.hull_radius + margin;
  std::vector<Index> near;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double dx = poses[k].x - middle.x;
    const double dy = poses[k].y - middle.y;
    const double far = reach + bodies.radii[k];
    if (dx * dx + dy * dy < far * far) near.push_back(static_cast<Index>(k));
  }
  return near;
}

}  // namespace

void step_works(ArrayView<const Pose, 2> swept, std::span<const double> masses,
                std::span<double> works) {
  for (std::size_t n = 0; n < works.size(); ++n) {
    const auto from = swept.row(static_cast<Index>(n));
    const auto to = swept.row(static_cast<Index>(n) + 1);
    works[n] = 0.0;
    for (std::size_t k = 0; k < masses.size(); ++k) {
      const double dx = to[k].x - from[k].x;
      const double dy = to[k].y - from[k].y;
      works[n] += masses[k] * std::sqrt(dx * dx + dy * dy);
    }
  }
}

void sweep_near(std::span<const Pose> path, std::span<Pose> poses, const IceBodies& bodies,
                const IceSettings& settings, double margin, ArrayView<Pose, 2> out,
                std::span<double> works) {
  const std::vector<Index> chosen = floes_near(path, poses, bodies, margin);
  const ChosenFloes floes(bodies, chosen);
  std::vector<Pose> here;
  here.reserve(chosen.size());
  for (const Index k : chosen) here.push_back(poses[at(k)]);
  const auto rows = static_cast<Index>(path.size());
  const auto columns = static_cast<Index>(chosen.size());
  std::vector<Pose> memory(at(rows * columns));
  const ArrayView<Pose, 2> moved(memory.data(), {rows, columns});
  IceContacts(floes.bodies, settings).sweep(path, here, moved);
  step_works(moved, floes.bodies.masses, works);
  for (Index n = 0; n < rows; ++n) {
    const auto row = out.row(n);
    std::copy(poses.begin(), poses.end(), row.begin());
    for (Index i = 0; i < columns; ++i) row[at(chosen[at(i)])] = moved(n, i);
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) poses[at(chosen[i])] = here[i];
}

}  // namespace pushplan
