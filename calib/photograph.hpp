/// \file
/// The steps between a camera's file and OpenCV.
#pragma once

#include <string>

namespace cv {
class Mat;
}

namespace afterglow::calib {

/// The pixels of a file that begins as PNG, JPEG, WebP, BMP, PNM or TIFF do, whatever its name;
/// `flags` are those of cv::imread. OpenCV as Debian builds it hands all else to libraries for maps
/// and medical pictures (GDAL, GDCM), and GDCM ends the process over a file that is cut short.
/// Throws std::runtime_error naming the file if it is none of these, cannot be decoded, or has more
/// than 128 million pixels by its header.
cv::Mat readPhotograph(const std::string& path, int flags);

}  // namespace afterglow::calib
