// Vectors and matrices in OpenGL's conventions.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace evalbus::viz {

struct Vec {
  float x, y, z;
};
inline Vec Of(const float* v) { return {v[0], v[1], v[2]}; }
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline float Dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec Cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec Unit(Vec a) {
  const float length = std::sqrt(Dot(a, a));
  return {a.x / length, a.y / length, a.z / length};
}

// 4x4 matrix in column-major order.
using Matrix = std::array<float, 16>;

inline Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (size_t column = 0; column < 4; ++column) {
    for (size_t row = 0; row < 4; ++row) {
      for (size_t k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

// Returns the world-to-eye transform for an eye at `eye`: x to the right, y up, z toward the viewer.
inline Matrix LookAlong(Vec eye, Vec forward, Vec up) {
  const Vec f = Unit(forward), s = Unit(Cross(f, up)), u = Unit(Cross(s, f));
  return {s.x, u.x, -f.x, 0, s.y,          u.y,          -f.y,        0,
          s.z, u.z, -f.z, 0, -Dot(s, eye), -Dot(u, eye), Dot(f, eye), 1};
}

// Returns the inverse of a rigid transform (rotation and translation only).
inline Matrix Inverse(const Matrix& m) {
  Matrix inverse{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) inverse[4 * i + j] = m[4 * j + i];
    inverse[12 + i] = -(m[4 * i] * m[12] + m[4 * i + 1] * m[13] + m[4 * i + 2] * m[14]);
  }
  inverse[15] = 1;
  return inverse;
}

// Transforms a point by an affine matrix (no perspective).
inline Vec Place(const Matrix& m, Vec v) {
  return {m[0] * v.x + m[4] * v.y + m[8] * v.z + m[12], m[1] * v.x + m[5] * v.y + m[9] * v.z + m[13],
          m[2] * v.x + m[6] * v.y + m[10] * v.z + m[14]};
}
// Turn rotates a direction by the upper-left 3x3 block of a rigid transform; TurnBack applies the inverse
// rotation.
inline Vec Turn(const Matrix& m, Vec v) {
  return {m[0] * v.x + m[4] * v.y + m[8] * v.z, m[1] * v.x + m[5] * v.y + m[9] * v.z,
          m[2] * v.x + m[6] * v.y + m[10] * v.z};
}
inline Vec TurnBack(const Matrix& m, Vec v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
          m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

}  // namespace evalbus::viz
