/// \file
/// Messages of ROS 2, byte by byte, and what is said of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "replay/messages/wire.hpp"

namespace afterglow::test {

/// Puts each number aligned to its size, as CDR (version 1) does.
class CdrBytes {
 public:
  explicit CdrBytes(bool is_big_endian = false, std::uint8_t padding = 0xEE)
      : is_big_(is_big_endian), padding_(padding) {
    bytes_ = {0, static_cast<std::uint8_t>(is_big_endian ? 0 : 1), 0, 0};
  }
  template <typename T>
  CdrBytes& put(T value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_.push_back(padding_);
    std::uint8_t number[sizeof(T)];
    replay::storeNumber(number, value);
    if (is_big_) std::reverse(number, number + sizeof(T));
    bytes_.insert(bytes_.end(), number, number + sizeof(T));
    return *this;
  }
  CdrBytes& text(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }
  operator const replay::Bytes&() const { return bytes_; }

 private:
  replay::Bytes bytes_;
  bool is_big_;
  std::uint8_t padding_;
};

/// The MessageError that the work throws; empty: it throws none.
template <typename Work>
std::string messageErrorOf(const Work& work) {
  try {
    work();
  } catch (const replay::MessageError& error) {
    return error.what();
  }
  return "";
}

}  // namespace afterglow::test
