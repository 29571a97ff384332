/// \file
/// Images for surfaces of uneven color: each lit pixel gets the values to send so that the color
/// asked for is the color seen where its light lands (calib/color/texture.hpp). GL-free.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calib/color/texture.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/compose/workers.hpp"
#include "render/scene/image.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// The light of the last image on a textured surface.
struct TextureReport {
  std::string surface;
  double white = 0;    ///< the light that is white all over it, camera's; 0: nothing of it is known
  double of_most = 0;  ///< its share of the brightest gray that half of the surface can show
  std::size_t lit = 0;      ///< pixels
  std::size_t clipped = 0;  ///< pixels whose color is out of reach
  std::size_t unknown = 0;  ///< pixels that fall where it was not photographed
};
/// Describes a report for people, without the surface's name.
std::string textureWords(const TextureReport& report);

/// A pixel belongs to the first surface on its ray, whatever layer it was drawn for. White is the
/// same all over a surface (calib::evenWhite of all that the projector lights); where it was not
/// photographed it is taken for its mean.
class TextureLight {
 public:
  /// `brightness`: share of its full light that white gets.
  TextureLight(const calib::Lens& lens, const std::vector<calib::SurfaceTexture>& textures,
               double brightness);
  ~TextureLight();
  TextureLight(const TextureLight&) = delete;
  TextureLight& operator=(const TextureLight&) = delete;

  /// Changes the values of all pixels [begin, end), of no textured surface.
  using Others = std::function<void(std::uint8_t* begin, std::uint8_t* end)>;

  /// Changes the image in place; the one that was drawn for this pose, of the lens's size. Black
  /// stays black. From one thread at a time, with the same `others` each time, as what it sent is
  /// kept while nothing moves.
  void apply(Image& image, const std::vector<SurfacePatch>& surfaces,
             const Rigid<Projector, World>& T_projector_world, const Others& others);

  /// By texture, of the last image.
  const std::vector<TextureReport>& reports() const { return reports_; }

 private:
  struct Texture;
  struct PlacedSurface;
  struct Block;
  struct Count;

  /// Returns true if something lies elsewhere than in the last image.
  bool place(const std::vector<SurfacePatch>& surfaces,
             const Rigid<Projector, World>& T_projector_world);
  void setWhite(PlacedSurface& surface) const;
  void sendRow(Image& image, std::size_t row, Block& block, const Others& others);
  void findSurfaces(Block& block) const;

  calib::Lens lens_;
  double brightness_;
  std::vector<std::unique_ptr<Texture>> textures_;
  /// Corners of blocks, row by row: their pixels' rays at z = 1 (not a number: there is none), and
  /// pixels by a square of rays.
  std::vector<int> columns_, rows_;
  std::vector<Eigen::Vector2f> rays_;
  std::vector<float> magnifications_;
  std::vector<PlacedSurface> placed_;
  std::vector<TextureReport> reports_;
  std::vector<Count> counts_;  ///< counts by block and texture
  /// While nothing moves, blocks are sent again where another picture was drawn.
  enum class Keeping { Nothing, Begun, All } keeping_ = Keeping::Nothing;
  Image drawn_, sent_;  ///< the last image, if it is kept
  Workers workers_;
};

}  // namespace afterglow::render
