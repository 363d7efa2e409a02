// Contacts of a crowd of convex bodies within one small step: found once, solved often.
//
// Bodies rest unless something moves them. In a step the hull moves by a known displacement; every
// pair that comes near gets one or two contact points with a gap, and the displacements of the
// bodies are those that close no gap beyond zero with the least total motion and Coulomb friction,
// by projected Gauss-Seidel on accumulated impulses (Catto, "Iterative Dynamics with Temporal
// Coherence", 2005, with velocities that start from zero). Pairs are looked for only around bodies
// that move.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "pushplan/geometry/pose.hpp"
#include "pushplan/interaction/contact.hpp"

namespace pushplan {

/// A hull among K floes.
struct IceBodies {
  Polygons hull;                             // convex parts in its body frame
  double hull_radius;                        // circumscribed [m]
  Compounds floes;                           // in their body frames
  std::span<const double> radii;             // (K,) circumscribed radii [m]
  std::span<const double> masses;            // (K,) [kg]
  std::span<const double> inverse_gyration;  // (K,) 1 / c^2 [1/m^2], c^2 being inertia over mass
};

struct IceSettings {
  double step;           // longest motion of a hull corner in one step [m]
  Index iterations;      // Gauss-Seidel rounds in a step
  double hull_friction;  // Coulomb coefficients between hull and floe,
  double friction;       // and between floes
  double still;  // displacement in a step below which a body does not look for neighbours [m]
};

/// The model with its memory, for one thread. The bodies' arrays have to outlive it. Nothing is
/// allocated after construction.
class IceContacts {
 public:
  IceContacts(const IceBodies& bodies, const IceSettings& settings);

  /// Works out the corners of all floes, which `drive` wants for the poses that it is given.
  void place(std::span<const Pose> poses);
  /// Works out those of one floe.
  void place(Index k, const Pose& pose);

  /// Moves the hull to a pose in small steps, along a straight line. Changes the floes' poses.
  /// Returns `work` plus the work [kg m] of its steps, and how many steps it took.
  std::pair<double, Index> drive(const Pose& hull_from, const Pose& hull_to, std::span<Pose> poses,
                                 double work);

  /// Sweeps the hull along a path; `out`, (N, K), receives the poses at each pose of the path.
  /// Returns the work [kg m].
  double sweep(std::span<const Pose> path, std::span<Pose> poses, ArrayView<Pose, 2> out);

  const IceBodies& bodies() const { return bodies_; }
  const IceSettings& settings() const { return settings_; }

 private:
  enum class State : char { kResting, kTouched, kNeighboursKnown };

  static constexpr Index kHull = -1;  // number of the hull where bodies are numbered

  struct ContactPoint {
    Index a;  // a floe or the hull
    Index b;  // a floe
    Vec2 normal;
    Vec2 arm_a;  // from the body to the point [m]
    Vec2 arm_b;
    double gap;     // [m]
    double along;   // effective inverse mass along the normal
    double across;  // and across it
    double push;    // accumulated impulse along the normal
    double drag;    // and across it
  };

  double advance(const Pose& here, const Pose& by, std::span<Pose> poses);
  void meet_hull(const Pose& here, std::span<const Pose> poses);
  void meet_neighbours(Index k, std::span<const Pose> poses);
  bool meet(Index a, Polygon piece, const Box* box, Index b, Vec2 centre_a,
            std::span<const Pose> poses);
  void add(Index a, Index b, const Contacts& found, Vec2 centre_a, std::span<const Pose> poses);
  void relax(const Pose& hull_move);
  Polygon part(Index p) const { return Polygons{corners_, bodies_.floes.parts.offsets}[p]; }

  IceBodies bodies_;
  IceSettings settings_;
  std::vector<Vec2> hull_;       // corners in the world frame
  std::vector<Vec2> corners_;    // of the floes' parts, kept up to date
  std::vector<Box> boxes_;       // around the parts, and around those of the hull: only where there
  std::vector<Box> hull_boxes_;  // are floes of several parts
  std::vector<Pose> moves_;      // displacement of each floe in this step
  std::vector<State> state_;
  std::vector<ContactPoint> points_;
  std::size_t most_points_;  // more are left out
};

}  // namespace pushplan
