#include "nodes/projector/found_surfaces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "nodes/conversion/cloud_conversion.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"
#include "render/scene/triangulate.hpp"
#include "render/surfaces/plane_finder.hpp"

namespace afterglow::nodes {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points thatCount(const Points& points, const SurfaceSearch& search) {
  Points counted;
  std::copy_if(points.begin(), points.end(), std::back_inserter(counted), [&](const auto& p) {
    return p.z() >= search.least_height && p.z() <= search.greatest_height &&
           (search.within.empty() || render::isInside(search.within, p.template head<2>()));
  });
  return counted;
}

std::string search(const SurfaceSearch& search, const Points& points, FoundSurface& found) {
  render::PlaneSearch plane_search;
  plane_search.max_tilt = search.max_tilt;
  const render::FoundPlane plane = render::findPlane(thatCount(points, search), plane_search);
  found.T_frame_surface = plane.T_points_plane;
  found.polygon = plane.polygon;
  Eigen::Vector2d low = plane.polygon.front(), high = low;
  for (const Eigen::Vector2d& p : plane.polygon) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double tilt = std::acos(std::min(1.0, plane.T_points_plane.linear()(2, 2))) * 180 / M_PI;
  return fmt::format(
      "{:.2f} x {:.2f} m at height {:.3f} m, tilted {:.1f} deg, {} points, residual {:.1f} mm",
      high.x() - low.x(), high.y() - low.y(), plane.T_points_plane.translation().z(), tilt,
      plane.count, 1e3 * plane.residual);
}

std::string measure(const ReliefConfig& config, const Points& points, FoundSurface& found) {
  const Eigen::Isometry3d T_surface_frame = found.T_frame_surface.inverse();
  Points in_surface;
  for (const Eigen::Vector3d& p : points) in_surface.push_back(T_surface_frame * p);
  found.relief = std::make_shared<const render::Relief>(
      render::reliefFromPoints(in_surface, found.polygon, config.options));
  const render::Relief& relief = *found.relief;
  return fmt::format("relief of {} x {} cells, {:.0f} % of them known, {:.3f} to {:.3f} m high",
                     relief.columns() - 1, relief.rows() - 1, 100 * relief.knownShare(),
                     relief.least(), relief.greatest());
}

/// The points are in the surface's frame; the list of a search or relief that is not configured is
/// empty. Never throws.
Finding findSurface(const SurfaceConfig& config, const Points& search_points,
                    const Points& relief_points) {
  const std::string name = "surface '" + config.name + "': ";
  try {
    FoundSurface found;
    found.polygon = config.polygon;
    std::string text;
    if (config.search) text = search(*config.search, search_points, found);
    if (config.relief) {
      text += (text.empty() ? "" : "; ") + measure(*config.relief, relief_points, found);
    }
    return {std::make_shared<const FoundSurface>(std::move(found)), name + text};
  } catch (const std::exception& error) {
    return {nullptr, name + error.what()};
  }
}

}  // namespace

SurfaceFinder::SurfaceFinder(const std::vector<SurfaceConfig>& surfaces,
                             const tf2::BufferCore& buffer)
    : surfaces_(surfaces), buffer_(buffer) {
  const auto want = [this](const std::string& topic) {
    if (std::find(topics_.begin(), topics_.end(), topic) == topics_.end()) topics_.push_back(topic);
  };
  for (const SurfaceConfig& surface : surfaces_) {
    if (surface.search) want(surface.search->topic);
    if (surface.relief) want(surface.relief->topic);
  }
  for (const std::string& topic : topics_) faults_[topic] = "no cloud on " + topic;
}

bool SurfaceFinder::take(const std::string& topic, const sensor_msgs::PointCloud2& cloud) {
  std::string fault = headerFault(cloud.header);
  std::map<std::string, Eigen::Isometry3d> T_frame_cloud;
  for (const SurfaceConfig& surface : surfaces_) {
    const bool is_wanted = (surface.search && surface.search->topic == topic) ||
                           (surface.relief && surface.relief->topic == topic);
    if (!is_wanted || !fault.empty()) continue;
    const std::string frame = frameName(cloud.header.frame_id);
    const auto T = FrameLookup(buffer_, surface.frame).at(frame, cloud.header.stamp);
    if (!T) {
      faults_[topic] = "no transform from '" + frame + "' to '" + surface.frame +
                       "' at the time of the cloud on " + topic;
      return false;
    }
    T_frame_cloud[surface.frame] = *T;
  }
  const auto converted = toPointCloud(cloud, CloudStyle{});
  if (!converted.value) fault = converted.reason;
  for (const auto& [frame, T] : T_frame_cloud) {
    if (!converted.value) break;
    Points& points = points_[{topic, frame}];
    for (const auto& p : converted.value->points) points.push_back(T * p.cast<double>());
  }
  topics_.erase(std::remove(topics_.begin(), topics_.end(), topic), topics_.end());
  faults_.erase(topic);
  if (!fault.empty()) faults_[topic] = "the cloud on " + topic + " cannot be read: " + fault;
  return true;
}

const Points& SurfaceFinder::points(const std::string& topic, const std::string& frame) const {
  static const Points kNone;
  const auto found = points_.find({topic, frame});
  return found != points_.end() ? found->second : kNone;
}

std::vector<Finding> SurfaceFinder::find() const {
  std::vector<Finding> findings;
  for (const SurfaceConfig& surface : surfaces_) {
    Finding finding;
    const std::string search = surface.search ? surface.search->topic : "";
    const std::string relief = surface.relief ? surface.relief->topic : "";
    const auto fault = std::find_if(faults_.begin(), faults_.end(), [&](const auto& entry) {
      return entry.first == search || entry.first == relief;
    });
    if (fault != faults_.end()) {
      finding.text = "surface '" + surface.name + "': " + fault->second;
    } else if (surface.isMeasured()) {
      finding = findSurface(surface, points(search, surface.frame), points(relief, surface.frame));
    }
    findings.push_back(std::move(finding));
  }
  return findings;
}

SceneSurfaces::SceneSurfaces(const std::vector<SurfaceConfig>& configs)
    : configs_(configs), patches_(configs.size()) {
  for (const SurfaceConfig& config : configs_) {
    FoundSurface given;
    given.polygon = config.polygon;
    Finding finding;
    if (config.isMeasured()) {
      finding.text = "surface '" + config.name + "': is to be found; call find_surfaces";
    } else {
      finding.surface = std::make_shared<const FoundSurface>(std::move(given));
    }
    findings_.push_back(std::move(finding));
  }
}

void SceneSurfaces::take(std::size_t surface, const Finding& finding) {
  // A surface that was found before stays: a cloud that does not show it tells nothing about it.
  if (finding.surface || !findings_[surface].surface) findings_[surface] = finding;
}

void SceneSurfaces::update(FrameLookup& frames, std::vector<std::string>& problems) {
  for (std::size_t i = 0; i < configs_.size(); ++i) {
    patches_[i].reset();
    const Finding& finding = findings_[i];
    if (!finding.surface) {
      problems.push_back(finding.text);
      continue;
    }
    const auto T_fixed_frame = frames.at(configs_[i].frame, ros::Time(0));
    if (!T_fixed_frame) {
      problems.push_back(
          frames.noTransform("surface '" + configs_[i].name + "'", configs_[i].frame));
      continue;
    }
    patches_[i] = render::SurfacePatch{
        configs_[i].name, Rigid<World, Surface>(*T_fixed_frame * finding.surface->T_frame_surface),
        finding.surface->polygon, finding.surface->relief};
  }
}

std::vector<render::SurfacePatch> SceneSurfaces::known() const {
  std::vector<render::SurfacePatch> known;
  for (const auto& patch : patches_) {
    if (patch) known.push_back(*patch);
  }
  return known;
}

}  // namespace afterglow::nodes
