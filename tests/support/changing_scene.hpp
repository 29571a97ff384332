/// \file
/// A scene of everything that changes a little from image to image: for drawers that keep what
/// stays.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "render/scene/scene.hpp"

namespace afterglow::test {

/// Of any shape but a mesh, of a color that may be translucent, somewhere before the lens.
inline render::Drawable randomDrawable(std::mt19937& random, const render::SharedBody& letters) {
  std::uniform_real_distribution<float> unit(0, 1);
  const auto between = [&](float low, float high) { return low + (high - low) * unit(random); };
  const Eigen::Vector3f size(between(0.02f, 0.3f), 0.1f, between(0.02f, 0.2f));
  render::PointCloud squares;
  squares.style = render::PointStyle::Squares;
  squares.size = 0.02f;
  render::PointList many;
  for (int i = 0; i < 250; ++i) {
    many.emplace_back(between(-0.2f, 0.2f), between(-0.2f, 0.2f), between(-0.1f, 0.1f));
  }
  const render::PointList few(many.begin(), many.begin() + 30);
  squares.points = unit(random) < 0.5f ? many : few;
  render::PointCloud pixels = squares;
  pixels.style = render::PointStyle::Points;
  pixels.size = 3;
  render::Lines lines;
  lines.points = few;
  lines.colors = render::ColorList(few.size(), render::Color{1, between(0, 1), 0, 1});
  render::ShapeList list;
  list.points = squares.points;
  list.size = Eigen::Vector3f::Constant(0.03f);
  if (unit(random) < 0.5f) list.kind = render::ShapeList::Kind::Spheres;
  const std::vector<render::Shape> shapes = {render::Arrow{},
                                             render::Cube{size},
                                             render::Sphere{size},
                                             render::Cylinder{size},
                                             lines,
                                             list,
                                             render::Triangles{few, {}},
                                             render::Text{letters},
                                             squares,
                                             pixels};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(double(between(0, 3)), Eigen::Vector3d(1, 2, 3).normalized()));
  T.translation() = Eigen::Vector3f(between(-0.6f, 0.6f), between(-0.4f, 0.4f), between(1.1f, 1.9f))
                        .cast<double>();
  return {Rigid<World, World>(T),
          shapes[random() % shapes.size()],
          {between(0, 1), between(0, 1), between(0, 1), unit(random) < 0.7f ? 1 : 0.5f}};
}

class ChangingScene {
 public:
  ChangingScene() {
    render::Body letter;
    letter.points = {{0, 0, 0}, {0.2f, 0, 0}, {0, 0.3f, 0}};
    letter.triangles = {{0, 1, 2}};
    letter.outline = {{0, 1}, {1, 2}, {2, 0}};
    letters_ = std::make_shared<const render::Body>(letter);
    Eigen::Isometry3d T_world_board = Eigen::Isometry3d::Identity();
    T_world_board.translation().z() = 1.5;
    const render::SurfacePatch board{
        "board", Rigid<World, Surface>(T_world_board), {{-0.5, -0.4}, {0.5, -0.4}, {0, 0.4}}};
    T_world_board.translation() = Eigen::Vector3d(0.2, 0.1, 1.3);
    const render::SurfacePatch before{
        "before", Rigid<World, Surface>(T_world_board), {{0, 0}, {0.1, 0}, {0.1, 0.2}}};
    scene = {{render::Layer{}, render::Layer{}}, {before, board}};
    scene.layers[1].placement = render::Placement::Drape;
    scene.layers[1].surface = board;
    for (render::Layer& layer : scene.layers) {
      for (int i = 0; i < 30; ++i) layer.drawables.push_back(randomDrawable(random_, letters_));
    }
  }

  Rigid<Projector, World> T_projector_world() const { return Rigid<Projector, World>(T_); }

  /// Changes something, or nothing.
  void change() {
    auto& drawables = scene.layers[random_() % scene.layers.size()].drawables;
    render::Drawable& one = drawables[random_() % drawables.size()];
    switch (random_() % 12) {
      case 0:
        drawables.insert(drawables.begin(), randomDrawable(random_, letters_));
        break;
      case 1:
        if (drawables.size() > 3) drawables.pop_back();
        break;
      case 2:
        std::swap(one, drawables.back());
        break;
      case 3:
        T_.translation().x() += 0.01;
        break;
      case 4:
        scene.surfaces[0].polygon[0].x() -= 0.05;
        break;
      case 5:
        scene.layers[1].gain *= 0.9f;
        break;
      case 6:
        one.color.a = one.color.a == 1 ? 0.6f : 1;
        break;
      case 7:
        scene.layers.push_back(scene.layers[0]);
        break;
      case 8:
        if (scene.layers.size() > 2) scene.layers.pop_back();
        break;
      case 9:
        break;
      default:
        one = randomDrawable(random_, letters_);
    }
  }

  render::Scene scene;

 private:
  std::mt19937 random_{11};
  render::SharedBody letters_;
  Eigen::Isometry3d T_ = Eigen::Isometry3d::Identity();
};

}  // namespace afterglow::test
