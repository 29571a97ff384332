#include "render/gl/thrown_light.hpp"

#include <algorithm>
#include <cmath>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <stdexcept>

#include "render/gl/glm_eigen.hpp"
#include "render/gl/render_target.hpp"
#include "render/gl/shader.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr float kGain = 8;  ///< white light at a meter, in units of what white paint shows as white

}  // namespace

bool isSameLens(const calib::Lens& a, const calib::Lens& b) {
  return a.width == b.width && a.height == b.height && a.K == b.K && a.D == b.D &&
         a.model == b.model;
}

ThrownLight::ThrownLight() {
  glTextureStorage2D(mask_.id(), 1, GL_R8, LitMask::kWidth, LitMask::kHeight);
  setSampling(mask_, GL_NEAREST, GL_CLAMP_TO_BORDER);  // whose color is black
}

void ThrownLight::setLensOf(const ProjectedLight& light) {
  if (lit_mask_ && isSameLens(lens_, light.lens)) return;
  lens_ = light.lens;
  lit_mask_.emplace(lens_);
  P_shadow_optical_ = ShadowMap::clipFromOptical(lens_);
  shadow_texel_ = ShadowMap::texelSize(lens_);
  image_ = Texture::make(GL_TEXTURE_2D);
  glTextureStorage2D(image_.id(), 1, GL_RGBA8, lens_.width, lens_.height);
  setSampling(image_, GL_LINEAR);
}

void ThrownLight::set(const ProjectedLight& light) {
  setLensOf(light);
  T_projector_world_ = toGlm(light.T_projector_world.matrix().matrix());
  p_world_projector_ = glm::dvec3(glm::inverse(T_projector_world_)[3]);
  P_shadow_world_ = P_shadow_optical_ * T_projector_world_;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(image_.id(), 0, 0, 0, lens_.width, lens_.height, GL_RGB, GL_UNSIGNED_BYTE,
                      light.image.rgb.data());
  glTextureSubImage2D(mask_.id(), 0, 0, 0, LitMask::kWidth, LitMask::kHeight, GL_RED,
                      GL_UNSIGNED_BYTE, lit_mask_->mark(light.image).data());
}

std::optional<std::array<glm::dvec3, 4>> ThrownLight::corners() const {
  if (!lit_mask_ || lit_mask_->marked().isEmpty()) return std::nullopt;
  const Eigen::Vector2d low = lit_mask_->marked().min(), high = lit_mask_->marked().max();
  const glm::dmat4 T_world_clip = glm::inverse(P_shadow_world_);
  const auto direction = [&](double x, double y) {
    const glm::dvec4 p = T_world_clip * glm::dvec4(x, y, 0, 1);
    return glm::normalize(glm::dvec3(p) / p.w - p_world_projector_);
  };
  return std::array<glm::dvec3, 4>{direction(low.x(), low.y()), direction(high.x(), low.y()),
                                   direction(high.x(), high.y()), direction(low.x(), high.y())};
}

void ThrownLight::use(const Program& mark_program, const Program& lit_program) const {
  setUniform(mark_program, "lit_mask", kMaskUnit);
  setUniform(mark_program, "P_shadow_world", glm::mat4(P_shadow_world_));
  setUniform(lit_program, "projector_image", kImageUnit);
  setUniform(lit_program, "shadow_map", kShadowUnit);
  setLens(lit_program, lens_);
  setUniform(lit_program, "fold_radius", static_cast<float>(std::min(lens_.fold_radius, 1e6)));
  setUniform(lit_program, "shadow_texel", static_cast<float>(shadow_texel_));
  setUniform(lit_program, "projector_gain", kGain);
  setUniform(lit_program, "T_projector_world", glm::mat4(T_projector_world_));
  setUniform(lit_program, "P_shadow_optical", glm::mat4(P_shadow_optical_));
  setUniform(lit_program, "p_world_projector", glm::vec3(p_world_projector_));
  glBindTextureUnit(kImageUnit, image_.id());
  glBindTextureUnit(kShadowUnit, shadow_map_.texture().id());
  glBindTextureUnit(kMaskUnit, mask_.id());
}

// ------------------------------------------------------------------------------------- depths
ShadowMap::ShadowMap(int size) : size_(size) {
  glTextureStorage2D(depth_.id(), 1, GL_DEPTH_COMPONENT32F, size, size);
  // Outside the frustum nothing is in the way.
  const float far[4] = {1, 1, 1, 1};
  glTextureParameterfv(depth_.id(), GL_TEXTURE_BORDER_COLOR, far);
  setSampling(depth_, GL_LINEAR, GL_CLAMP_TO_BORDER);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTextureParameteri(depth_.id(), GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glNamedFramebufferTexture(framebuffer_.id(), GL_DEPTH_ATTACHMENT, depth_.id(), 0);
  glNamedFramebufferDrawBuffer(framebuffer_.id(), GL_NONE);
  glNamedFramebufferReadBuffer(framebuffer_.id(), GL_NONE);
  if (glCheckNamedFramebufferStatus(framebuffer_.id(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("GL cannot draw into a depth texture");
  }
}

/// A frustum around the lens's axis, of the size that is wanted, moved on the image to where the
/// lens has it.
glm::dmat4 ShadowMap::clipFromOptical(const calib::Lens& lens) {
  const LensDomain domain(lens);
  const glm::dvec2 low = toGlm(domain.min()), high = toGlm(domain.max());
  const glm::dvec2 size = high - low, to_middle = -(high + low) / size;
  const glm::dmat4 P_around_axis =
      glm::infinitePerspectiveLH(2 * std::atan(size.y / 2), size.x / size.y, LensDomain::kNear);
  return glm::translate(glm::dmat4(1), glm::dvec3(to_middle, 0)) * P_around_axis;
}

double ShadowMap::texelSize(const calib::Lens& lens) {
  const LensDomain domain(lens);
  return (domain.max() - domain.min()).maxCoeff() / kSize;
}

void ShadowMap::begin() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, size_, size_);
  glDepthMask(GL_TRUE);
  glClearDepth(1);
  glClear(GL_DEPTH_BUFFER_BIT);
}

// ---------------------------------------------------------------------------------- lit places
LitMask::LitMask(const calib::Lens& lens)
    : columns_((lens.width + kBlock - 1) / kBlock), rows_((lens.height + kBlock - 1) / kBlock) {
  const LensDomain domain(lens);
  const Eigen::Array2d size = (domain.max() - domain.min()).array();
  const Eigen::Array2i last(kWidth - 1, kHeight - 1);
  // Rays through the blocks' corners, half a pixel outside of their first pixels' centers.
  std::vector<std::optional<Eigen::Vector3d>> rays;
  for (int row = 0; row <= rows_; ++row) {
    for (int column = 0; column <= columns_; ++column) {
      rays.push_back(calib::unproject(lens, {column * kBlock - 0.5, row * kBlock - 0.5}));
    }
  }
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      Cells cells{last, -Eigen::Array2i::Ones()};
      for (int corner = 0; corner < 4; ++corner) {
        const int index = (row + corner / 2) * (columns_ + 1) + column + corner % 2;
        const auto& ray = rays[static_cast<std::size_t>(index)];
        if (!ray) continue;
        const Eigen::Array2d at = (ray->head<2>() - domain.min()).array() / size;
        const Eigen::Array2i cell = (at * Eigen::Array2d(kWidth, kHeight)).floor().cast<int>();
        // One more on each side: for a block's bulge, and for bilinear look-ups beside it.
        cells.low = cells.low.min(cell - 1).max(0);
        cells.high = cells.high.max(cell + 1).min(last);
      }
      cells_of_.push_back(cells);
    }
  }
}

bool LitMask::isLit(const Image& image, int column, int row) const {
  const int u = column * kBlock, width = std::min(kBlock, image.width - u);
  const int v_end = std::min((row + 1) * kBlock, image.height);
  for (int v = row * kBlock; v < v_end; ++v) {
    const std::uint8_t* pixels =
        &image.rgb[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(u))];
    unsigned any = 0;
    for (int i = 0; i < 3 * width; ++i) any |= pixels[i];
    if (any != 0) return true;
  }
  return false;
}

const std::vector<std::uint8_t>& LitMask::mark(const Image& image) {
  marked_.setEmpty();
  mask_.assign(static_cast<std::size_t>(kWidth) * kHeight, 0);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      if (!isLit(image, column, row)) continue;
      const Cells& cells = cells_of_[static_cast<std::size_t>(row * columns_ + column)];
      const Eigen::Array2d count(kWidth, kHeight);
      if ((cells.low <= cells.high).all()) {
        marked_.extend((2 * cells.low.cast<double>() / count - 1).matrix());
        marked_.extend((2 * (cells.high + 1).cast<double>() / count - 1).matrix());
      }
      for (int y = cells.low.y(); y <= cells.high.y(); ++y) {
        const auto begin = mask_.begin() + y * kWidth;
        if (cells.low.x() <= cells.high.x()) {
          std::fill(begin + cells.low.x(), begin + cells.high.x() + 1, std::uint8_t{255});
        }
      }
    }
  }
  return mask_;
}

}  // namespace afterglow::render
