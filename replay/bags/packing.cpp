#include "replay/bags/packing.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#ifdef AFTERGLOW_WITH_ZSTD
#include <zstd.h>
#endif

#include <algorithm>
#include <memory>
#include <string>

namespace afterglow::replay {
namespace {

constexpr std::size_t kFirstStep = 1 << 20;
#ifdef AFTERGLOW_WITH_ZSTD
constexpr int kZstdLevel = 1;  ///< recordings are written as they come
#endif

/// The result of one step of unpacking.
struct Progress {
  std::size_t read = 0, written = 0;
  bool is_end = false;
};

/// `step(from, from_size, to, to_size)` unpacks some of it.
template <typename Step>
Bytes unpackInSteps(const Bytes& packed, std::size_t size, const Step& step) {
  Bytes bytes;
  std::size_t read = 0, written = 0;
  for (Progress done; !done.is_end; read += done.read, written += done.written) {
    // Room for one byte more than expected, to notice too many bytes.
    if (written == bytes.size()) {
      bytes.resize(std::min(size + 1, std::max(kFirstStep, 2 * bytes.size())));
    }
    done = step(packed.data() + read, packed.size() - read, bytes.data() + written,
                bytes.size() - written);
    if (written + done.written > size) {
      throw BagDamage("holds more than the " + std::to_string(size) + " bytes that it says");
    }
    if (!done.is_end && done.read == 0 && done.written == 0) {
      throw BagDamage("is cut short within its compressed data");
    }
  }
  if (written != size || read != packed.size()) {
    throw BagDamage("holds " + std::to_string(written) + " bytes, not the " +
                    std::to_string(size) + " that it says");
  }
  bytes.resize(size);
  return bytes;
}

Bytes unpackLz4(const Bytes& packed, std::size_t size) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) {
    throw BagDamage("cannot be unpacked: no memory");
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, &LZ4F_freeDecompressionContext);
  return unpackInSteps(packed, size, [&](auto* from, std::size_t from_size, auto* to,
                                         std::size_t to_size) {
    Progress done{from_size, to_size, false};
    const std::size_t left =
        LZ4F_decompress(context.get(), to, &done.written, from, &done.read, nullptr);
    if (LZ4F_isError(left) != 0) {
      throw BagDamage(std::string("is damaged: lz4 says ") + LZ4F_getErrorName(left));
    }
    done.is_end = left == 0;
    return done;
  });
}

/// Ends a bzip2 stream, in all cases.
struct Bz2Stream : bz_stream {
  Bz2Stream() : bz_stream() {
    if (BZ2_bzDecompressInit(this, 0, 0) != BZ_OK) {
      throw BagDamage("cannot be unpacked: no memory");
    }
  }
  Bz2Stream(const Bz2Stream&) = delete;
  Bz2Stream& operator=(const Bz2Stream&) = delete;
  ~Bz2Stream() { BZ2_bzDecompressEnd(this); }
};

Bytes unpackBz2(Bytes& packed, std::size_t size) {
  Bz2Stream stream;
  stream.next_in = reinterpret_cast<char*>(packed.data());
  stream.avail_in = static_cast<unsigned>(packed.size());
  return unpackInSteps(
      packed, size, [&](auto*, std::size_t from_size, auto* to, std::size_t to_size) {
        stream.next_out = reinterpret_cast<char*>(to);
        stream.avail_out = static_cast<unsigned>(to_size);
        const int code = BZ2_bzDecompress(&stream);
        if (code != BZ_OK && code != BZ_STREAM_END) {
          throw BagDamage("is damaged: bzip2 says " + std::to_string(code));
        }
        return Progress{from_size - stream.avail_in, to_size - stream.avail_out,
                        code == BZ_STREAM_END};
      });
}

#ifdef AFTERGLOW_WITH_ZSTD
Bytes unpackZstd(const Bytes& packed, std::size_t size) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (!stream) throw BagDamage("cannot be unpacked: no memory");
  return unpackInSteps(
      packed, size, [&](auto* from, std::size_t from_size, auto* to, std::size_t to_size) {
        ZSTD_inBuffer in{from, from_size, 0};
        ZSTD_outBuffer out{to, to_size, 0};
        const std::size_t left = ZSTD_decompressStream(stream.get(), &out, &in);
        if (ZSTD_isError(left) != 0) {
          throw BagDamage(std::string("is damaged: zstd says ") + ZSTD_getErrorName(left));
        }
        // Another frame may follow: padding is one that holds nothing.
        return Progress{in.pos, out.pos, left == 0 && in.pos == from_size};
      });
}

Bytes packZstd(const Bytes& bytes) {
  Bytes packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) {
    throw BagDamage(std::string("cannot be packed: zstd says ") + ZSTD_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}
#else
Bytes unpackZstd(const Bytes&, std::size_t) {
  throw BagDamage("is compressed by zstd, which this build cannot: libzstd was not found");
}

Bytes packZstd(const Bytes&) {
  throw BagDamage("cannot be compressed by zstd: this build found no libzstd");
}
#endif

Bytes packBz2(Bytes bytes) {
  constexpr int kLevel = 9;
  Bytes packed(bytes.size() + bytes.size() / 100 + 600);  // bzip2's own bound
  auto size = static_cast<unsigned>(packed.size());
  const int code = BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(packed.data()), &size,
                                            reinterpret_cast<char*>(bytes.data()),
                                            static_cast<unsigned>(bytes.size()), kLevel, 0, 0);
  if (code != BZ_OK) throw BagDamage("cannot be packed: bzip2 says " + std::to_string(code));
  packed.resize(size);
  return packed;
}

Bytes packLz4(const Bytes& bytes) {
  // The kind of frame that rosbag's own LZ4 (roslz4) reads.
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  Bytes packed(LZ4F_compressFrameBound(bytes.size(), &preferences));
  const std::size_t size =
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &preferences);
  if (LZ4F_isError(size) != 0) {
    throw BagDamage(std::string("cannot be packed: lz4 says ") + LZ4F_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}

}  // namespace

Bytes unpack(Packing packing, Bytes packed, std::size_t size) {
  switch (packing) {
    case Packing::Bz2:
      return unpackBz2(packed, size);
    case Packing::Lz4:
      return unpackLz4(packed, size);
    case Packing::Zstd:
      return unpackZstd(packed, size);
    case Packing::None:
      break;
  }
  if (packed.size() != size) throw BagDamage("has a damaged size");
  return packed;
}

std::optional<std::uint64_t> zstdSize(const Bytes& packed) {
  // RFC 8878, 3.1.1: the magic number, a descriptor, a window where the frame is in several pieces.
  constexpr std::uint8_t kMagic[] = {0x28, 0xb5, 0x2f, 0xfd};
  if (packed.size() < 6 || !std::equal(kMagic, kMagic + 4, packed.begin())) return std::nullopt;
  const std::uint8_t descriptor = packed[4];
  const bool is_single = (descriptor & 0x20) != 0;
  constexpr std::size_t kIdSizes[] = {0, 1, 2, 4};
  const std::size_t at = 5 + (is_single ? 0 : 1) + kIdSizes[descriptor & 3];
  const int kind = descriptor >> 6;
  const std::size_t size = kind == 0 ? (is_single ? 1 : 0) : std::size_t{1} << kind;
  if (size == 0 || at + size > packed.size()) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{packed[at + i]} << (8 * i);
  return size == 2 ? value + 256 : value;
}

Bytes pack(Packing packing, const Bytes& bytes) {
  switch (packing) {
    case Packing::Lz4:
      return packLz4(bytes);
    case Packing::Zstd:
      return packZstd(bytes);
    case Packing::Bz2:
      return packBz2(bytes);
    case Packing::None:
      break;
  }
  return bytes;
}

}  // namespace afterglow::replay
