// A kinematic robot among objects that stop at once when nothing pushes them, unless they roll or
// float.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "pushplan/envs/planar_drive.hpp"
#include "pushplan/envs/reach.hpp"

namespace pushplan {

struct PlanarSettings {
  double travel;     // distance that the fastest point may move in a substep [m]
  double tolerance;  // overlap at which the robot is held, when something static is involved [m]
  double rest;       // speed below which objects stop [m/s]
  double decay;      // fraction of its speed that an object may lose in a substep
  Index samples;     // poses recorded in a step at most
  bool holds;        // true if the robot keeps its direction while it turns
};

/// What happened in a step.
struct PlanarRecord {
  std::vector<Pose> robot;    // (T,)
  std::vector<Pose> objects;  // (T, K), one time after the other
  bool held = false;          // true if the robot was kept from moving as commanded
  bool touched = false;       // true if it touched something static
};

/// What moves in a scene, and how. The arrays behind it and the states have to outlive it.
class PlanarSimulator {
 public:
  PlanarSimulator(const Chipmunk& engine, const ChipmunkHandles& handles, const Reach& reach,
                  const Obstacles& obstacles, const Momentum& momentum,
                  const PlanarSettings& settings,
                  std::span<BodyState> states);  // (1 + K,) the robot, then each object

  /// Drives at a velocity ahead, a turn rate and a velocity to the left for `duration` [s].
  void step(double linear, double angular, double lateral, double duration);

  /// Drives straight at constant speed. Returns false if the robot was held.
  bool sweep(const Pose& to, const Pose& motion,  // difference to the pose now
             double length, double duration);

  /// Time [s], at most `limit`, in which the robot certainly touches nothing at this velocity.
  double clear_for(double linear, double angular, double lateral, double limit);

  /// What happened in the last step or sweep.
  const PlanarRecord& record() const { return record_; }
  /// The record of contacts; its address is for the engine's callbacks.
  StaticContacts& contacts() { return scene_.contacts(); }
  /// Number of objects that the engine simulated in the last step that needed it.
  std::size_t loaded() const { return active_.size(); }
  /// Number of objects.
  std::size_t count() const { return poses_.size(); }

  /// True if objects that cannot move are simulated as well: a reference for tests.
  bool loads_all = false;
  /// Greatest number of shapes that were in the engine at once.
  std::size_t most_shapes = 0;

 private:
  template <class Run>
  void simulate(Index samples, Run run);
  void glide(const ArcMotion& motion, double duration, Index samples);
  ArcMotion motion_of(double linear, double angular, double lateral) const;
  void start_record();
  void stop_objects();
  void look_at_objects();
  void choose(double reach, double duration);
  double clear_time(const ArcMotion& motion, double limit);

  ChipmunkScene scene_;
  PlanarDrive drive_;
  Reach reach_;
  Obstacles obstacles_;
  Momentum momentum_;
  PlanarSettings settings_;
  std::span<BodyState> states_;
  PlanarRecord record_;
  bool rolls_ = false;          // true if an object moves
  std::vector<Pose> poses_;     // (K,) of the objects before a step
  std::vector<double> speeds_;  // (K,) of their fastest points [m/s]
  std::vector<double> ways_;    // (K,) of these in a step [m]
  std::unique_ptr<bool[]> loaded_;
  std::unique_ptr<bool[]> missed_;
  std::vector<Index> active_;      // objects that are loaded
  std::vector<BodyState> start_;   // (1 + A,) states in the engine
  std::vector<BodyState> driven_;  // (T, 1 + A) of its samples
};

}  // namespace pushplan
