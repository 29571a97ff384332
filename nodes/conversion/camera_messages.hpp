/// \file
/// Messages of cameras as images and lenses, checked, since they come from the network; and images
/// and lenses as messages.
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "render/scene/image.hpp"

namespace afterglow::nodes {

/// mono8, 8UC1, rgb8, bgr8, 8UC3 (as bgr8), rgba8, bgra8; color becomes gray as OpenCV does it.
/// Throws std::invalid_argument, one line, for other encodings (16 bit, Bayer and compressed ones
/// with what to do), sizes below 16 px or above 16384 px a side, a step below a row's bytes and
/// data shorter than declared. is_bigendian means nothing to bytes and is ignored.
calib::Picture toPicture(const sensor_msgs::Image& message);
/// The same in its colors, without the alpha.
render::Image toColors(const sensor_msgs::Image& message);

/// K and D. Throws std::invalid_argument, one line with all that is wrong: an uncalibrated camera's
/// zeros, numbers that are not finite, models other than plumb_bob and rational_polynomial, binning
/// or a region of interest (K is then not that of the pictures).
calib::Lens toLens(const sensor_msgs::CameraInfo& message);

/// rgb8, without padding; the header is left to the caller.
sensor_msgs::Image toImage(render::Image image);

/// plumb_bob, or rational_polynomial where the lens needs its eight; R is the identity and P has K.
sensor_msgs::CameraInfo toCameraInfo(const calib::Lens& lens);

}  // namespace afterglow::nodes
