// Chipmunk, the planar engine inside Pymunk. Nothing is linked: it is called through the addresses
// of its functions, and what it keeps of a scene is known by address only.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "pushplan/envs/momentum.hpp"
#include "pushplan/geometry/pose.hpp"

struct cpArbiter;
struct cpBody;
struct cpShape;
struct cpSpace;

namespace pushplan {

/// Where two shapes touch, laid out as its cpContactPointSet; Vec2 is laid out as its cpVect.
struct ContactPoints {
  struct Point {
    Vec2 on_a;
    Vec2 on_b;
    double distance;  // negative where they overlap [m]
  };
  int count;
  Vec2 normal;
  Point points[2];
};

/// Its functions; pymunk_bodies.py has their names, in this order.
struct Chipmunk {
  void (*step)(cpSpace*, double);
  void (*set_collision_bias)(cpSpace*, double);
  void (*each_contact)(cpSpace*, void (*)(cpArbiter*, void*), void*);
  cpBody* (*add_body)(cpSpace*, cpBody*);
  void (*remove_body)(cpSpace*, cpBody*);
  cpShape* (*add_shape)(cpSpace*, cpShape*);
  void (*remove_shape)(cpSpace*, cpShape*);
  Vec2 (*position)(cpBody*);
  double (*angle)(cpBody*);
  Vec2 (*velocity)(cpBody*);
  double (*angular_velocity)(cpBody*);
  void (*set_position)(cpBody*, Vec2);
  void (*set_angle)(cpBody*, double);
  void (*set_velocity)(cpBody*, Vec2);
  void (*set_angular_velocity)(cpBody*, double);
  void (*set_force)(cpBody*, Vec2);
  void (*set_torque)(cpBody*, double);
  void (*update_position)(cpBody*, double);
  int (*contact_count)(cpArbiter*);
  double (*contact_depth)(cpArbiter*, int);  // a distance, in spite of its name
  ContactPoints (*contact_points)(cpArbiter*);
};

/// Addresses in the engine, which somebody else keeps alive.
struct ChipmunkHandles {
  cpSpace* space;               // with what is static
  std::vector<cpBody*> bodies;  // the kinematic robot, then each of K objects
  std::vector<std::vector<cpShape*>> shapes;  // of each body
};

/// What its callbacks record about the contacts of moving and static shapes.
struct StaticContacts {
  const Chipmunk* engine;
  Index objects = 0;     // touching pairs of an object and something static or fixed
  Index robot = 0;       // those of the robot
  bool touched = false;  // true if the robot has touched something static since the last `load`
  double depth = 0.0;    // deepest overlap of the robot in the last substep [m]
};

/// What the engine calls when a pair begins to touch, touches, and no longer touches, if anything.
/// The last argument is the address of a `StaticContacts`.
using ContactCallbacks = std::array<void (*)(cpArbiter*, cpSpace*, void*), 3>;

/// For pairs of the robot, or else an object, and a fixed object, or else what is static.
ContactCallbacks contact_callbacks(bool of_robot, bool with_fixed);

/// Pose and velocity of a body, world frame.
struct BodyState {
  Pose pose;
  Twist twist;
};

/// A robot and those of K objects that are loaded, in the engine.
class ChipmunkScene {
 public:
  ChipmunkScene(const Chipmunk& engine, const ChipmunkHandles& handles, const Momentum& momentum);
  ChipmunkScene(const ChipmunkScene&) = delete;
  ChipmunkScene& operator=(const ChipmunkScene&) = delete;
  ~ChipmunkScene() { unload(true); }

  /// Puts the robot and some objects into the space, and nothing else that moves. Contacts and
  /// corrections are forgotten, so that only the states decide what follows: shapes that are added
  /// anew in the same order give the same broad phase, and so the same order in which contacts are
  /// solved.
  void load(std::span<const Index> active,       // (A,) numbers of objects, increasing
            std::span<const BodyState> states);  // (1 + A,)

  /// Places every body; pending corrections of overlaps are dropped.
  void write(std::span<const BodyState> states);
  void read(std::span<BodyState> states) const;

  /// Moves everything by a substep of `h` [s], the robot at a velocity in the world frame.
  void advance(const Twist& robot, double h);

  /// Deepest overlap of any two bodies after the last substep [m], 0 if none.
  double depth() const;

  /// Heading of the robot [rad].
  double heading() const { return engine_.angle(bodies_[0]); }

  /// True if a moving shape touches a static one.
  bool touches_static() const { return contacts_.objects + contacts_.robot > 0; }

  /// Removes from states (1 + A,) the velocities that bodies do not keep for `h` [s] untouched.
  void slow(std::span<BodyState> states, double h) const;

  /// Number of shapes that are loaded.
  std::size_t shape_count() const { return shapes_.size(); }

  /// The record; its address is for the engine's callbacks.
  StaticContacts& contacts() { return contacts_; }

 private:
  void unload(bool with_bodies);
  void carry_on(double h);

  Chipmunk engine_;
  ChipmunkHandles handles_;
  Momentum momentum_;
  StaticContacts contacts_;
  std::vector<Index> active_;
  std::vector<cpBody*> bodies_;   // those that are loaded
  std::vector<cpShape*> shapes_;  // likewise
  bool carried_ = false;          // true if a loaded body keeps some of its velocity
  double h_ = 0.0;
  Twist robot_;  // velocity that the robot was given last
};

}  // namespace pushplan
