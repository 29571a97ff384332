#include "nodes/projector/scene_surfaces.hpp"

namespace afterglow::nodes {

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
  // What was found before stays: a cloud that does not show it says nothing about it.
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
