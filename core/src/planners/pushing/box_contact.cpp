#include "pushplan/planners/pushing/box_contact.hpp"


namespace pushplan::pushing {
namespace {

/// The bumper's velocity in the frame of the pushed face.
struct FaceVelocity {
  double n;
  double t;
  double w;
};

/// The box pushed at one point (-a, y) whose normal has an angle `tilt` in the frame of the face.
BoxMotion push_corner(const BoxContact& contact, double y, double tilt,
                      const FaceVelocity& bumper) {
  const double px = -contact.depth;
  const double square = contact.spread * contact.spread;
  // velocity of the bumper at the point
  const double cn = bumper.n - bumper.w * y;
  const double ct = bumper.t + bumper.w * px;
  const double total = square + px * px + y * y;
  const double vn = ((square + px * px) * cn + px * y * ct) / total;
  const double vt = (px * y * cn + (square + y * y) * ct) / total;
  const double nx = std::cos(tilt);
  const double ny = std::sin(tilt);
  const double press = vn * nx + vt * ny;
  const double shear = vt * nx - vn * ny;
  if (cn * nx + ct * ny <= 0.0) return {0.0, 0.0, 0.0, y, ContactMode::kFree, 0.0};
  if (press > 0.0 && std::abs(shear) <= contact.friction * press) {
    return {vn, vt, (px * vt - y * vn) / square, y, ContactMode::kCornerStick, shear / press};
  }
  const double ratio = shear > 0.0 ? contact.friction : -contact.friction;
  const double fx = nx - ratio * ny;
  const double fy = ny + ratio * nx;
  const double arm = px * fy - y * fx;
  const double lever = px * ny - y * nx;
  const double push = (cn * nx + ct * ny) / std::max(1.0 + arm * lever / square, 0.05);
  return {push * fx, push * fy, push * arm / square, y, ContactMode::kCornerSlide, ratio};
}

}  // namespace

BoxContact::Standoff BoxContact::standoff(double offset, double c, double s) const {
  Line touching = line(offset);
  if (touching.low >= touching.high) {
    touching.low = std::min(std::max(0.0, low), high);
    touching.high = touching.low;
  }
  double middle = 0.5 * (touching.low + touching.high);
  if (curvature < 0.0 && c > 1e-3) {
    middle = (-s / (c * curvature) - offset + depth * s) / c;
    middle = std::min(std::max(middle, touching.low), touching.high);
  }
  Standoff best{-kInfinity, 0.0};
  for (const double y : {touching.low, middle, touching.high}) {
    const double lateral = offset - depth * s + y * c;
    const double x = front + 0.5 * curvature * lateral * lateral + depth * c + y * s;
    if (x > best.x + 1e-12) best = {x, y};
  }
  return best;
}

PushedBox contact_velocity(const BoxContact& contact, double offset, double angle, double c,
                           double s, const Twist& twist, double dt) {
  const auto [x, touch] = contact.standoff(offset, c, s);
  const double w = twist.w;
  const double ux = twist.v - w * offset;
  const double uy = w * x;
  const double un = c * ux + s * uy;
  const double ut = c * uy - s * ux;
  const FaceVelocity bumper{un, ut, w};
  const auto [low, high] = contact.line(offset);
  const double curvature = contact.curvature;
  const double a = contact.depth;
  const double square = contact.spread * contact.spread;
  // no line, or a nose: one point that rolls along the face
  if (low >= high || curvature < 0.0) return {push_corner(contact, touch, 0.0, bumper), x};
  const double off = angle - contact.flush_angle(offset);
  const double slope = -curvature / (1.0 - curvature * a);
  const double closing = w - off / dt;
  const double normal = un + (closing - w) * touch;
  // held fast: no motion along the bumper
  double vt = ut;
  double omega = closing;
  const double grip = 1.0 - curvature * a;
  double shear = vt * grip - curvature * square * omega;
  ContactMode mode = ContactMode::kStick;
  if (std::abs(shear) > contact.friction * std::max(normal, 0.0)) {
    mode = ContactMode::kSlide;
    const double ratio = shear > 0.0 ? contact.friction : -contact.friction;
    vt = (ratio * std::max(normal, 0.0) + curvature * square * (closing - slope * ut)) /
         (grip - curvature * square * slope);
    omega = closing + slope * (vt - ut);
    shear = ratio * normal;
  }
  double pressure = omega < 0.0 ? kInfinity : -kInfinity;
  if (normal > 1e-12) pressure = -(square * omega + a * vt) / normal;
  if (low <= pressure && pressure <= high) {
    return {{normal, vt, omega, pressure, mode, shear / normal}, x};
  }
  const double y = pressure > high ? high : low;
  double tilt = 0.0;
  if ((y == contact.high && y == high) || (y == contact.low && y == low)) {
    const double lateral = offset - a * s + y * c;
    tilt = -curvature * lateral - angle;  // the box's corner on the bumper, not the bumper's end
  }
  return {push_corner(contact, y, tilt, bumper), x};
}

}  // namespace pushplan::pushing
