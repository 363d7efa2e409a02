#include "pushplan/envs/chipmunk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pushplan {
namespace {

constexpr double kCorrection = 0.2;  // of an overlap beyond the slop, taken back in one substep
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

StaticContacts& record(void* static_contacts) {
  return *static_cast<StaticContacts*>(static_contacts);
}

void begin_object(cpArbiter*, cpSpace*, void* data) { ++record(data).objects; }
void end_object(cpArbiter*, cpSpace*, void* data) { --record(data).objects; }
void begin_robot_fixed(cpArbiter*, cpSpace*, void* data) { ++record(data).robot; }
void end_robot(cpArbiter*, cpSpace*, void* data) { --record(data).robot; }

void begin_robot_static(cpArbiter*, cpSpace*, void* data) {
  ++record(data).robot;
  record(data).touched = true;
}

/// The engine keeps no contact of two bodies neither of which it can push, so that it is measured
/// while it is found.
void measure_robot(cpArbiter* arbiter, cpSpace*, void* data) {
  StaticContacts& contacts = record(data);
  const ContactPoints found = contacts.engine->contact_points(arbiter);
  for (int i = 0; i < found.count; ++i) {
    contacts.depth = std::max(contacts.depth, -found.points[i].distance);
  }
}

void measure(cpArbiter* arbiter, void* data) {
  StaticContacts& contacts = record(data);
  for (int i = 0; i < contacts.engine->contact_count(arbiter); ++i) {
    contacts.depth = std::max(contacts.depth, -contacts.engine->contact_depth(arbiter, i));
  }
}

}  // namespace

ContactCallbacks contact_callbacks(bool of_robot, bool with_fixed) {
  if (!of_robot) return {begin_object, nullptr, end_object};
  return {with_fixed ? begin_robot_fixed : begin_robot_static, measure_robot, end_robot};
}

ChipmunkScene::ChipmunkScene(const Chipmunk& engine, const ChipmunkHandles& handles,
                             const Momentum& momentum)
    : engine_(engine), handles_(handles), momentum_(momentum), contacts_{&engine_} {
  active_.reserve(handles.bodies.size());
  bodies_.reserve(handles.bodies.size());
  shapes_.reserve(handles.shapes.size());
}

void ChipmunkScene::unload(bool with_bodies) {
  for (cpShape* shape : shapes_) engine_.remove_shape(handles_.space, shape);
  if (!with_bodies) return;
  for (cpBody* body : bodies_) engine_.remove_body(handles_.space, body);
}

void ChipmunkScene::load(std::span<const Index> active, std::span<const BodyState> states) {
  const bool same = !bodies_.empty() && std::ranges::equal(active, active_);
  unload(!same);
  if (!same) {
    active_.assign(active.begin(), active.end());
    bodies_.assign(1, handles_.bodies[0]);
    shapes_ = handles_.shapes[0];
    carried_ = false;
    for (const Index k : active) {
      bodies_.push_back(handles_.bodies[static_cast<std::size_t>(k + 1)]);
      const auto& own = handles_.shapes[static_cast<std::size_t>(k + 1)];
      shapes_.insert(shapes_.end(), own.begin(), own.end());
      carried_ = carried_ || momentum_.keeps[static_cast<std::size_t>(k + 1)] > 0.0;
    }
    for (cpBody* body : bodies_) engine_.add_body(handles_.space, body);
  }
  write(states);  // first, as the broad phase remembers where a shape was when it came
  for (cpShape* shape : shapes_) engine_.add_shape(handles_.space, shape);
  contacts_ = {&engine_};
}

void ChipmunkScene::write(std::span<const BodyState> states) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    cpBody* body = bodies_[i];
    const auto& [pose, twist] = states[i];
    engine_.update_position(body, 0.0);  // empties the hidden correction velocity
    engine_.set_position(body, {pose.x, pose.y});
    engine_.set_angle(body, pose.theta);
    engine_.set_velocity(body, {twist.vx, twist.vy});
    engine_.set_angular_velocity(body, twist.omega);
  }
  robot_ = {kUnknown, kUnknown, kUnknown};
}

void ChipmunkScene::read(std::span<BodyState> states) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    cpBody* body = bodies_[i];
    const Vec2 place = engine_.position(body);
    const Vec2 velocity = engine_.velocity(body);
    states[i] = {{place.x, place.y, engine_.angle(body)},
                 {velocity.x, velocity.y, engine_.angular_velocity(body)}};
  }
}

void ChipmunkScene::advance(const Twist& robot, double h) {
  contacts_.depth = 0.0;
  if (robot.vx != robot_.vx || robot.vy != robot_.vy || robot.omega != robot_.omega) {
    robot_ = robot;
    engine_.set_velocity(bodies_[0], {robot.vx, robot.vy});
    engine_.set_angular_velocity(bodies_[0], robot.omega);
  }
  if (h != h_) {  // the engine wants the fraction of an overlap that is left after a second
    h_ = h;
    const double left = std::pow(1.0 - kCorrection, 1.0 / h);
    engine_.set_collision_bias(handles_.space, std::max(left, 1e-300));
  }
  if (carried_) carry_on(h);
  engine_.step(handles_.space, h);
}

double ChipmunkScene::depth() const {
  StaticContacts deepest = contacts_;
  engine_.each_contact(handles_.space, measure, &deepest);
  return deepest.depth;
}

void ChipmunkScene::slow(std::span<BodyState> states, double h) const {
  states[0].twist = {0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < active_.size(); ++i) {
    Twist& twist = states[i + 1].twist;
    twist = momentum_.after(active_[i] + 1, twist, h);
  }
}

/// Gives each object the force that restores what it keeps of its velocity. The engine zeroes
/// velocities after it has moved the bodies and before it solves contacts, and adds force times `h`
/// over mass in between.
void ChipmunkScene::carry_on(double h) {
  for (std::size_t i = 0; i < active_.size(); ++i) {
    cpBody* body = bodies_[i + 1];
    const Vec2 velocity = engine_.velocity(body);
    const Twist kept = momentum_.after(active_[i] + 1,
                                       {velocity.x, velocity.y, engine_.angular_velocity(body)}, h);
    const Inertia& inertia = momentum_.inertia[static_cast<std::size_t>(active_[i] + 1)];
    const double mass_rate = inertia.mass / h;
    engine_.set_force(body, {kept.vx * mass_rate, kept.vy * mass_rate});
    engine_.set_torque(body, kept.omega * (inertia.moment / h));
  }
}

}  // namespace pushplan
