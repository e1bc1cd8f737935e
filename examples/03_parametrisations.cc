// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// A study: what the coordinates of a rotation, and those of a point, do to a solver. The engine has
// one update of rotations, a left perturbation on the group; the others are written out here, each
// with the same Levenberg-Marquardt loop around it, to see where they fail. Points are the engine's
// own. docs/parametrisations.md shows what this prints and says why.

#include <sheaf/sheaf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<double, 9>;  // row-major
constexpr double kPi = 3.14159265358979323846, kDegree = kPi / 180;

Vec3 operator*(const Mat3& m, const Vec3& v) {
  Vec3 out{};
  for (int i = 0; i < 9; ++i) out[i / 3] += m[i] * v[i % 3];
  return out;
}
Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 out{};
  for (int i = 0; i < 27; ++i) out[i / 9 * 3 + i % 3] += a[i / 9 * 3 + i / 3 % 3] * b[i % 9];
  return out;
}
Mat3 transposed(const Mat3& m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }

Mat3 from_quaternion(double w, double x, double y, double z) {
  const double s = 2 / (w * w + x * x + y * y + z * z);  // any norm
  return {1 - s * (y * y + z * z), s * (x * y - w * z),     s * (x * z + w * y),
          s * (x * y + w * z),     1 - s * (x * x + z * z), s * (y * z - w * x),
          s * (x * z - w * y),     s * (y * z + w * x),     1 - s * (x * x + y * y)};
}

Mat3 from_angle_axis(const Vec3& v) {
  const double angle = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const double s = angle < 1e-8 ? 0.5 : std::sin(angle / 2) / angle;
  return from_quaternion(std::cos(angle / 2), s * v[0], s * v[1], s * v[2]);
}

/// Numbers that are the same with every standard library.
struct Random {
  std::mt19937_64 bits;
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * kPi * uniform());
  }
};

// ---- Rotations -----------------------------------------------------------------------------

/// How a rotation turns when its numbers change: column j of the 3 x size matrix is the angle-axis
/// of R(p + h e_j) R(p)^T, by h, to first order.
using Turning = std::array<std::array<double, 4>, 3>;

/// A way to write a rotation with `size` numbers and to step them by as many.
struct Rotation {
  const char* name;
  int size;
  Mat3 (*matrix)(const double* p);
  Turning (*turning)(const double* p);
  void (*step)(double* p, const double* d);
  bool evenly = false;  ///< damp all numbers alike, not each by its own column (Marquardt)
};

template <int N>
void add(double* p, const double* d) {
  for (int i = 0; i < N; ++i) p[i] += d[i];
}
void normalise(double* p) {
  const double norm = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  for (int i = 0; i < 4; ++i) p[i] /= norm;
}

/// roll, pitch, yaw: R = Rz Ry Rx turns about Rz Ry x, Rz y and z.
Mat3 euler_matrix(const double* p) {
  return from_angle_axis({0, 0, p[2]}) * from_angle_axis({0, p[1], 0}) *
         from_angle_axis({p[0], 0, 0});
}
Turning euler_turning(const double* p) {
  const Mat3 z = from_angle_axis({0, 0, p[2]}), zy = z * from_angle_axis({0, p[1], 0});
  return {{{zy[0], z[1], 0}, {zy[3], z[4], 0}, {zy[6], z[7], 1}}};
}

/// I + (1 - cos a) / a^2 [v]_x + (a - sin a) / a^3 [v]_x^2, a = |v|.
Mat3 angle_axis_matrix(const double* p) { return from_angle_axis({p[0], p[1], p[2]}); }
Turning angle_axis_turning(const double* p) {
  const double a = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  const double b = a < 1e-4 ? 0.5 : (1 - std::cos(a)) / (a * a);
  const double c = a < 1e-4 ? 1.0 / 6 : (a - std::sin(a)) / (a * a * a);
  const Mat3 v{0, -p[2], p[1], p[2], 0, -p[0], -p[1], p[0], 0}, v2 = v * v;
  Turning out{};
  for (int i = 0; i < 9; ++i) out[i / 3][i % 3] = (i % 4 == 0) + b * v[i] + c * v2[i];
  return out;
}

/// Twice the vector part of dq q^-1.
Mat3 quaternion_matrix(const double* p) { return from_quaternion(p[0], p[1], p[2], p[3]); }
Turning quaternion_turning(const double* p) {
  const double s = 2 / (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  const double w = s * p[0], x = s * p[1], y = s * p[2], z = s * p[3];
  return {{{-x, w, -z, y}, {-y, z, w, -x}, {-z, -y, x, w}}};
}

/// The state is a quaternion, the step d three numbers: R <- exp(d) R.
Turning group_turning(const double*) { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
void group_step(double* p, const double* d) {
  const double a = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const double s = a < 1e-8 ? 0.5 : std::sin(a / 2) / a, w = std::cos(a / 2);
  const double x = s * d[0], y = s * d[1], z = s * d[2];
  const double q[4] = {p[0], p[1], p[2], p[3]};
  p[0] = w * q[0] - x * q[1] - y * q[2] - z * q[3];
  p[1] = w * q[1] + x * q[0] + y * q[3] - z * q[2];
  p[2] = w * q[2] - x * q[3] + y * q[0] + z * q[1];
  p[3] = w * q[3] + x * q[2] - y * q[1] + z * q[0];
  normalise(p);
}

const Rotation kEuler{"Euler angles", 3, euler_matrix, euler_turning, add<3>};
const Rotation kAngleAxis{"angle-axis, summed", 3, angle_axis_matrix, angle_axis_turning, add<3>};
const Rotation kLoose{"quaternion, norm left alone", 4, quaternion_matrix, quaternion_turning,
                      add<4>};
const Rotation kUnit{"quaternion, normalised", 4, quaternion_matrix, quaternion_turning,
                     [](double* p, const double* d) { add<4>(p, d), normalise(p); }};
const Rotation kLooseEvenly{"  the same, damped evenly", 4,      quaternion_matrix,
                            quaternion_turning,          add<4>, true};
const Rotation kUnitEvenly{"  the same, damped evenly", 4,          quaternion_matrix,
                           quaternion_turning,          kUnit.step, true};
const Rotation kGroup{"left perturbation", 3, quaternion_matrix, group_turning, group_step};

/// Largest over smallest singular value of the turning: how much further some numbers have to go
/// than others for the same turn. By Jacobi's rotations of A A^T.
double condition(const Rotation& r, const double* p) {
  const Turning a = r.turning(p);
  double m[3][3]{};
  for (int i = 0; i < 27; ++i)
    for (int k = 0; i % 3 == 0 && k < 4; ++k) m[i / 9][i / 3 % 3] += a[i / 9][k] * a[i / 3 % 3][k];
  for (int sweep = 0; sweep < 60; ++sweep) {
    const int i = sweep % 3 == 2 ? 1 : 0, k = sweep % 3 == 0 ? 1 : 2;
    const double angle = 0.5 * std::atan2(2 * m[i][k], m[i][i] - m[k][k]);
    const double c = std::cos(angle), s = std::sin(angle);
    for (int l = 0; l < 3; ++l) {
      const double x = m[i][l], y = m[k][l];
      m[i][l] = c * x + s * y, m[k][l] = c * y - s * x;
    }
    for (int l = 0; l < 3; ++l) {
      const double x = m[l][i], y = m[l][k];
      m[l][i] = c * x + s * y, m[l][k] = c * y - s * x;
    }
  }
  const auto [low, high] = std::minmax({m[0][0], m[1][1], m[2][2]});
  return std::sqrt(high / std::max(low, 1e-300));
}

/// One image of known points: what is sought is its pose, the rotation's numbers and t.
struct Image {
  std::vector<Vec3> points;
  std::vector<std::array<double, 2>> pixels;
};
constexpr double kFocal_px = 800;

struct Pose {
  std::array<double, 4> p{};  // numbers of the rotation
  Vec3 t{};
};

/// A damped system of the pose's numbers, and the cost 1/2 sum |r|^2.
struct Normal {
  double A[7][7] = {}, b[7] = {}, cost = 0;
};

/// With the exact derivatives of docs/math.md: a turn phi moves R X by phi x R X.
Normal linearise(const Rotation& rotation, const Image& image, const Pose& pose) {
  const Mat3 R = rotation.matrix(pose.p.data());
  const Turning turning = rotation.turning(pose.p.data());
  const int n = rotation.size + 3;
  Normal out;
  for (std::size_t i = 0; i < image.points.size(); ++i) {
    const Vec3 X = R * image.points[i];
    const double iz = -1 / (X[2] + pose.t[2]);
    for (int row = 0; row < 2; ++row) {
      const double p = (X[row] + pose.t[row]) * iz, r = kFocal_px * p - image.pixels[i][row];
      Vec3 a{0, 0, kFocal_px * iz * p};
      a[row] = kFocal_px * iz;
      const Vec3 by_turn{X[1] * a[2] - X[2] * a[1], X[2] * a[0] - X[0] * a[2],
                         X[0] * a[1] - X[1] * a[0]};
      double J[7] = {};
      for (int j = 0; j < rotation.size; ++j)
        for (int k = 0; k < 3; ++k) J[j] += by_turn[k] * turning[k][j];
      for (int k = 0; k < 3; ++k) J[rotation.size + k] = a[k];
      for (int j = 0; j < n; ++j) {
        out.b[j] -= J[j] * r;
        for (int k = 0; k < n; ++k) out.A[j][k] += J[j] * J[k];
      }
      out.cost += r * r / 2;
    }
  }
  return out;
}

Pose stepped(const Rotation& rotation, const Pose& from, const double* d) {
  Pose to = from;
  rotation.step(to.p.data(), d);
  for (int k = 0; k < 3; ++k) to.t[k] += d[rotation.size + k];
  return to;
}

/// Solves the system damped by lambda diag(A) by Gauss' elimination, into b.
void solve_damped(const Rotation& rotation, Normal& m, double lambda) {
  const int n = rotation.size + 3;
  double most = 1e-6;
  for (int k = 0; k < rotation.size; ++k) most = std::max(most, m.A[k][k]);
  for (int k = 0; k < n; ++k)
    m.A[k][k] += lambda * (rotation.evenly && k < rotation.size ? most : std::max(m.A[k][k], 1e-6));
  for (int k = 0; k < n; ++k)
    for (int i = k + 1; i < n; ++i) {
      const double f = m.A[i][k] / m.A[k][k];
      for (int j = k; j < n; ++j) m.A[i][j] -= f * m.A[k][j];
      m.b[i] -= f * m.b[k];
    }
  for (int k = n - 1; k >= 0; --k) {
    for (int j = k + 1; j < n; ++j) m.b[k] -= m.A[k][j] * m.b[j];
    m.b[k] /= m.A[k][k];
  }
}

struct Effort {
  int steps = 0, rejected = 0;
  double cost = 0;
};

/// Levenberg and Marquardt's loop, the same for all.
Effort find_pose(const Rotation& rotation, const Image& image, Pose& pose) {
  Effort effort;
  Normal held = linearise(rotation, image, pose);
  effort.cost = held.cost;
  for (double lambda = 1e-4; effort.steps < 100;) {
    Normal damped = held;
    solve_damped(rotation, damped, lambda);
    const Pose tried = stepped(rotation, pose, damped.b);
    const Normal there = linearise(rotation, image, tried);
    const double change = std::abs(there.cost - effort.cost) / effort.cost;
    ++effort.steps;
    if (there.cost < effort.cost) {
      pose = tried, held = there, effort.cost = there.cost;
      lambda = std::max(lambda / 10, 1e-10);
    } else {
      ++effort.rejected;
      lambda *= 4;
    }
    if (change < 1e-9) break;
  }
  return effort;
}

/// A camera turns over twice, 5 degrees from image to image, and wobbles: a flight through every
/// orientation that a parametrisation may not like. Points lie all around.
std::vector<Image> make_flight() {
  Random random{std::mt19937_64(1)};
  std::vector<Vec3> points(900);
  for (Vec3& X : points) {
    const double z = random.uniform(-1, 1), around = random.uniform(0, 2 * kPi);
    const double far = random.uniform(4, 8), ring = far * std::sqrt(1 - z * z);
    X = {ring * std::cos(around), ring * std::sin(around), far * z};
  }
  std::vector<Image> flight(145);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const double turn = 5 * kDegree * static_cast<double>(i), wobble = 0.2 * std::sin(3 * turn);
    const Mat3 R =
        from_angle_axis({0, turn, 0}) * from_angle_axis({0.6 * wobble, 0.1 * wobble, 0.8 * wobble});
    const Vec3 t{0.5 * std::sin(turn), 0.3 * std::cos(2 * turn), 0.2};
    for (const Vec3& X : points) {
      Vec3 P = R * X;
      for (int k = 0; k < 3; ++k) P[k] += t[k];
      if (P[2] > -1 || std::hypot(P[0], P[1]) > -0.7 * P[2]) continue;
      flight[i].points.push_back(X);
      flight[i].pixels.push_back({-kFocal_px * P[0] / P[2] + 0.5 * random.normal(),
                                  -kFocal_px * P[1] / P[2] + 0.5 * random.normal()});
    }
  }
  return flight;
}

void study_rotations() {
  std::printf("How unevenly a rotation answers to its numbers (1: evenly)\n");
  std::printf("degrees from the singularity        30     10      3      1    0.1   0.01\n");
  const double degrees[] = {30, 10, 3, 1, 0.1, 0.01};
  const auto row = [&](const char* what, const Rotation& r, auto numbers) {
    std::printf("%-31s", what);
    for (double d : degrees) {
      const std::array<double, 4> p = numbers(d * kDegree);
      const double c = condition(r, p.data());
      std::printf(c < 10 ? " %6.2f" : " %6.0f", c);
    }
    std::printf("\n");
  };
  using P = std::array<double, 4>;
  row("Euler angles, pitch 90", kEuler, [](double d) { return P{0.3, kPi / 2 - d, 0.2, 0}; });
  row("angle-axis, 180 degrees", kAngleAxis, [](double d) { return P{0, kPi - d, 0, 0}; });
  row("angle-axis, 360 degrees", kAngleAxis, [](double d) { return P{0, 2 * kPi - d, 0, 0}; });
  row("quaternion, 360 degrees", kUnit, [](double d) {
    return P{std::cos(kPi - d / 2), 0, std::sin(kPi - d / 2), 0};
  });
  row("left perturbation, 360 degrees", kGroup, [](double d) {
    return P{std::cos(kPi - d / 2), 0, std::sin(kPi - d / 2), 0};
  });

  std::printf(
      "\nA camera that turns over twice, each of its 144 images solved from the one before\n");
  std::printf("                              steps  rejected  worst image  images lost  norm\n");
  const std::vector<Image> flight = make_flight();
  std::vector<double> best(flight.size(), 1e300);
  for (const Rotation& r : {kGroup, kUnit, kUnitEvenly, kLoose, kLooseEvenly, kAngleAxis, kEuler}) {
    Pose pose;
    if (r.matrix == quaternion_matrix) pose.p[0] = 1;
    int steps = 0, rejected = 0, worst = 0, lost = 0;
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const Effort effort = find_pose(r, flight[i], pose);
      best[i] = std::min(best[i], effort.cost);  // the group's, which goes first, or better
      if (i == 0) continue;
      steps += effort.steps, rejected += effort.rejected;
      worst = std::max(worst, effort.steps);
      lost += effort.cost > 1.001 * best[i];
    }
    const auto& p = pose.p;
    const double norm = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    std::printf("%-28s %6d %9d %12d %12d", r.name, steps, rejected, worst, lost);
    if (r.matrix == quaternion_matrix) std::printf("  %.3f", norm);
    std::printf("\n");
  }
}

// ---- Points --------------------------------------------------------------------------------

/// Eight cameras in a row, one unit apart. Points stand 4 to 20 units before them; of a third the
/// distance is 1000 to a million. The start has its cameras off by a few pixels, and its points
/// where the rays of the first and the last image that see them pass each other.
sheaf::Problem make_row(bool far) {
  Random random{std::mt19937_64(3)};
  sheaf::Problem problem;
  std::vector<double> turns;
  for (int i = 0; i < 8; ++i) {
    const double turn = 2e-3 * random.normal();  // about y, to be found
    sheaf::Pose pose;
    pose.rotation = {std::cos(turn / 2), 0, std::sin(turn / 2), 0};
    const Vec3 moved = from_angle_axis({0, turn, 0}) * Vec3{-1.0 * i, 0.3 * (i % 2), 0};
    pose.translation = {moved[0], moved[1], moved[2]};
    problem.add_image(pose, sheaf::Camera{.parameters = {kFocal_px, 0, 0}});
    turns.push_back(turn);
  }
  for (int q = 0; q < 450; ++q) {
    const bool away = far && q % 3 == 0;
    const double depth = away ? 1000 * std::pow(1000, random.uniform()) : random.uniform(4, 20);
    const double middle = away ? 3.5 : random.uniform(0, 7);
    const Vec3 X{middle + depth * random.uniform(-0.35, 0.35), depth * random.uniform(-0.35, 0.35),
                 -depth};
    const int first = away ? 0 : std::clamp(static_cast<int>(middle - 1.5), 0, 4);
    const int end = away ? 8 : first + 4;
    const std::uint32_t point = problem.add_point(0, 0, 0);
    double x[8] = {}, y = 0;
    for (int i = first; i < end; ++i) {
      x[i] = kFocal_px * (X[0] - i) / depth + 0.5 * random.normal();
      const double v = kFocal_px * (X[1] + 0.3 * (i % 2)) / depth + 0.5 * random.normal();
      if (i == first) y = v;
      problem.add_observation(static_cast<std::uint32_t>(i), point, x[i], v);
    }
    // Inverse depth from the parallax of the row, as the turned cameras show it; at most 1e5 units.
    const double parallax = (x[first] - x[end - 1]) / kFocal_px - (turns[first] - turns[end - 1]);
    const double s = std::max(parallax / (end - 1 - first), 1e-5);
    problem.points[3 * point] = first + (x[first] / kFocal_px - turns[first]) / s;
    problem.points[3 * point + 1] = y / kFocal_px / s - 0.3 * (first % 2);
    problem.points[3 * point + 2] = -1 / s;
  }
  return problem;
}

void study_points() {
  using sheaf::PointParametrisation;
  const struct {
    const char* name;
    PointParametrisation points;
  } kinds[] = {{"xyz", PointParametrisation::xyz},
               {"homogeneous", PointParametrisation::homogeneous},
               {"inverse depth", PointParametrisation::inverse_depth}};
  for (bool far : {false, true}) {
    std::printf("\n%s\n", far ? "A third of them beyond 1000 baselines" : "All points near");
    std::printf("                steps   to 1e-3   1e-6   1e-9   cost above the best   behind\n");
    const sheaf::Problem start = make_row(far);
    std::vector<sheaf::Summary> all;
    double best = 1e300;
    for (const auto& kind : kinds) {
      sheaf::Problem problem = start;
      sheaf::SolveOptions options;
      options.points = kind.points;
      options.fixed.f = options.fixed.k1 = options.fixed.k2 = true;  // a row leaves them open
      options.tolerance = 1e-13;
      options.max_iterations = 200;
      options.threads = 1;
      all.push_back(sheaf::solve(problem, options));
      best = std::min(best, all.back().final_cost);
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
      std::printf("%-15s %5zu   ", kinds[k].name, all[k].iterations.size() - 1);
      for (double target : {1e-3, 1e-6, 1e-9}) {
        const auto there = std::find_if(
            all[k].iterations.begin(), all[k].iterations.end(),
            [&](const sheaf::Iteration& it) { return it.cost <= best * (1 + target); });
        if (there == all[k].iterations.end())
          std::printf("%7s", "-");
        else
          std::printf("%7d", there->index);
      }
      const double above = all[k].final_cost / best - 1;
      std::printf(above < 1e-12 ? "   %19.0f" : "   %19.1e", above);
      std::printf("   %6zu\n", all[k].behind_camera_after.size());
    }
  }
}

}  // namespace

int main() {
  study_rotations();
  study_points();
  return 0;
}
