#include "render/gl/shader.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <glm/ext/matrix_transform.hpp>

namespace afterglow::render::glm_eigen_test {
namespace {

TEST(GlmEigen, keepsEveryElementInItsPlace) {
  Eigen::Matrix4d M;
  M << 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16;
  const glm::dmat4 same = toGlm(M);
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) EXPECT_EQ(same[column][row], M(row, column));
  }
  EXPECT_EQ(toGlm(Eigen::Matrix3d(M.topLeftCorner<3, 3>())), glm::dmat3(same));
  EXPECT_EQ(toGlm(Eigen::Vector2d(1, 2)), glm::dvec2(1, 2));
  EXPECT_EQ(toGlm(Eigen::Vector3d(1, 2, 3)), glm::dvec3(1, 2, 3));
}

TEST(GlmEigen, carriesPointsToTheSamePlaces) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.3, -2, 5;
  T.rotate(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, 0.5).normalized()));
  const Eigen::Vector3d p(0.1, 0.7, -0.4);
  const glm::dvec3 moved(toGlm(T.matrix()) * glm::dvec4(toGlm(p), 1));
  EXPECT_LT(glm::distance(moved, toGlm(Eigen::Vector3d(T * p))), 1e-15);
  const glm::dmat4 turned = glm::rotate(glm::dmat4(1), 0.8, glm::normalize(glm::dvec3(1, 2, 0.5)));
  for (int column = 0; column < 3; ++column) {
    EXPECT_LT(glm::distance(turned[column], toGlm(T.matrix())[column]), 1e-15);
  }
}

}  // namespace
}  // namespace afterglow::render::glm_eigen_test
