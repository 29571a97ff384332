#include "render/surfaces/plane_finder.hpp"

#include <pcl/ModelCoefficients.h>
#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>
#include <pcl/surface/concave_hull.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr std::size_t kFewest = 50;  // points
/// Points are thinned to one in such a cube, so that their number stands for area, whatever the
/// distance they were seen from.
constexpr double kGrain = 0.01;
constexpr double kFarthest = 1e3;  // meters from the origin; farther points belong to no surface
constexpr double kGap = 0.05;      // meters
/// Radius of the circle that rolls around the points to find the outline: notches that are narrower
/// than it belong to the surface.
constexpr double kRim = 0.08;
constexpr double kRimTolerance = 0.005;  // of the outline's corners, meters
constexpr int kTrials = 2000;
/// A plane through three points is tilted by their noise: fitted to its points, it finds others.
constexpr int kRefinements = 4;

Cloud::Ptr thinned(const std::vector<Eigen::Vector3d>& points) {
  struct Placed {
    std::array<std::int32_t, 3> cube;
    std::uint32_t index;
    bool operator<(const Placed& other) const {
      return cube != other.cube ? cube < other.cube : index < other.index;
    }
  };
  std::vector<Placed> placed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].array().abs() < kFarthest).all()) continue;
    const Eigen::Array3i cube = (points[i].array() / kGrain).floor().cast<std::int32_t>();
    placed.push_back({{cube.x(), cube.y(), cube.z()}, static_cast<std::uint32_t>(i)});
  }
  std::sort(placed.begin(), placed.end());
  Cloud::Ptr cloud(new Cloud);
  for (auto first = placed.begin(); first != placed.end();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    auto last = first;
    for (; last != placed.end() && last->cube == first->cube; ++last) sum += points[last->index];
    const Eigen::Vector3f mean = (sum / static_cast<double>(last - first)).cast<float>();
    cloud->push_back({mean.x(), mean.y(), mean.z()});
    first = last;
  }
  return cloud;
}

/// Empty if there is none.
pcl::PointIndices::Ptr pointsOnAPlane(const Cloud::Ptr& cloud, const PlaneSearch& search) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // the messages below say as much
  pcl::SACSegmentation<pcl::PointXYZ> segmentation;         // its random numbers have a fixed seed
  segmentation.setModelType(pcl::SACMODEL_PERPENDICULAR_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setAxis(search.up.normalized().cast<float>());
  segmentation.setEpsAngle(search.max_tilt);
  segmentation.setDistanceThreshold(search.max_distance);
  segmentation.setMaxIterations(kTrials);
  segmentation.setOptimizeCoefficients(false);  // that is left to the part that counts
  segmentation.setInputCloud(cloud);
  pcl::PointIndices::Ptr inliers(new pcl::PointIndices);
  pcl::ModelCoefficients plane;
  segmentation.segment(*inliers, plane);
  return inliers;
}

pcl::PointIndices::Ptr pointsOnPlane(const Cloud::Ptr& cloud, const Eigen::Isometry3d& T,
                                     double max_distance) {
  const Eigen::Isometry3d T_plane_points = T.inverse();
  pcl::PointIndices::Ptr found(new pcl::PointIndices);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const Eigen::Vector3d p = (*cloud)[i].getVector3fMap().cast<double>();
    if (std::abs((T_plane_points * p).z()) <= max_distance) {
      found->indices.push_back(static_cast<int>(i));
    }
  }
  return found;
}

std::vector<Eigen::Vector3d> largestPart(const Cloud::Ptr& cloud,
                                         const pcl::PointIndices::Ptr& on_plane) {
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(kGap);
  extraction.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  extraction.setInputCloud(cloud);
  extraction.setIndices(on_plane);
  std::vector<pcl::PointIndices> parts;
  extraction.extract(parts);
  std::vector<Eigen::Vector3d> part;
  const auto largest = std::max_element(
      parts.begin(), parts.end(),
      [](const auto& a, const auto& b) { return a.indices.size() < b.indices.size(); });
  if (largest == parts.end()) return part;
  for (const int i : largest->indices) {
    part.push_back((*cloud)[static_cast<std::size_t>(i)].getVector3fMap().cast<double>());
  }
  return part;
}

/// Least squares. x along the points' x as far as the plane allows.
Eigen::Isometry3d fitPlane(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  Eigen::Vector3d n = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  if (n.dot(up) < 0) n = -n;
  const bool is_across_x = std::abs(n.x()) > 0.9;  // a wall: y then
  const Eigen::Vector3d along = is_across_x ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear().col(0) = (along - n * n.dot(along)).normalized();
  T.linear().col(1) = n.cross(T.linear().col(0));
  T.linear().col(2) = n;
  T.translation() = mean;
  return T;
}

using Polygon = std::vector<Eigen::Vector2d>;

Polygon simplified(const Polygon& polygon) {
  std::vector<cv::Point2f> exact, fewer;
  for (const Eigen::Vector2d& p : polygon) {
    exact.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  cv::approxPolyDP(exact, fewer, kRimTolerance, true);
  Polygon result;
  for (const cv::Point2f& p : fewer) result.emplace_back(p.x, p.y);
  if (signedArea(result) < 0) std::reverse(result.begin(), result.end());
  return result;
}

/// Returns the outline of the plane's part, in the plane's frame; empty if it has none.
Polygon outlineOf(const std::vector<Eigen::Vector3d>& part,
                  const Eigen::Isometry3d& T_plane_points) {
  Cloud::Ptr flat(new Cloud);
  for (const Eigen::Vector3d& p : part) {
    const Eigen::Vector3f q = (T_plane_points * p).cast<float>();
    flat->push_back({q.x(), q.y(), 0});
  }
  pcl::ConcaveHull<pcl::PointXYZ> hull;
  hull.setDimension(2);
  hull.setAlpha(kRim);
  hull.setInputCloud(flat);
  Cloud corners;
  std::vector<pcl::Vertices> rings;
  hull.reconstruct(corners, rings);
  Polygon largest;
  for (const pcl::Vertices& ring : rings) {
    Polygon polygon;
    for (const auto i : ring.vertices) {
      const auto& corner = corners[static_cast<std::size_t>(i)];
      polygon.emplace_back(corner.x, corner.y);
    }
    if (std::abs(signedArea(polygon)) > std::abs(signedArea(largest))) largest = polygon;
  }
  return largest.empty() ? largest : simplified(largest);
}

void moveToMiddle(FoundPlane& plane) {
  Eigen::Vector2d low = plane.polygon.front(), high = low;
  for (const Eigen::Vector2d& p : plane.polygon) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Eigen::Vector2d middle = (low + high) / 2;
  for (Eigen::Vector2d& p : plane.polygon) p -= middle;
  plane.T_points_plane.translate(Eigen::Vector3d(middle.x(), middle.y(), 0));
}

std::string areaText(double area) { return std::to_string(std::lround(area * 1e4)) + " cm2"; }

}  // namespace

FoundPlane findPlane(const std::vector<Eigen::Vector3d>& points, const PlaneSearch& search) {
  const Cloud::Ptr cloud = thinned(points);
  if (cloud->size() < kFewest) {
    throw std::runtime_error("too few points to find a plane in: " + std::to_string(cloud->size()) +
                             " a centimeter apart");
  }
  FoundPlane plane;
  std::vector<Eigen::Vector3d> part = largestPart(cloud, pointsOnAPlane(cloud, search));
  for (int i = 0; i < kRefinements && part.size() >= 3; ++i) {
    plane.T_points_plane = fitPlane(part, search.up);
    part = largestPart(cloud, pointsOnPlane(cloud, plane.T_points_plane, search.max_distance));
  }
  const bool is_level =
      plane.T_points_plane.linear().col(2).dot(search.up.normalized()) >= std::cos(search.max_tilt);
  if (part.size() >= 3 && is_level) {
    plane.polygon = outlineOf(part, plane.T_points_plane.inverse());
    plane.area = signedArea(plane.polygon);
  }
  if (!(plane.area >= search.least_area)) {
    throw std::runtime_error("no plane among " + std::to_string(points.size()) +
                             " points: the largest part of one has " + areaText(plane.area));
  }
  moveToMiddle(plane);
  const Eigen::Isometry3d T_plane_points = plane.T_points_plane.inverse();
  double sum = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = T_plane_points * point;
    if (!(std::abs(p.z()) <= search.max_distance) || !isInside(plane.polygon, p.head<2>()))
      continue;
    ++plane.count;
    sum += p.z() * p.z();
  }
  plane.residual = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, plane.count)));
  return plane;
}

}  // namespace afterglow::render
