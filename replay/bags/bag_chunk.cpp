#include "replay/bags/bag_chunk.hpp"

#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>
#include <memory>
#include <string>

namespace afterglow::replay {
namespace {

constexpr std::size_t kFirstStep = 1 << 20;

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

}  // namespace

std::optional<BagFields> BagFields::parse(const std::uint8_t* bytes, std::size_t size) {
  BagFields parsed;
  parsed.fields_.reserve(4);
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  for (std::size_t at = 0; at < size;) {
    if (size - at < 4) return std::nullopt;
    const std::size_t length = loadNumber<std::uint32_t>(bytes + at);
    at += 4;
    if (length > size - at) return std::nullopt;
    const std::string_view field = all.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    parsed.fields_.emplace_back(field.substr(0, equals), field.substr(equals + 1));
    at += length;
  }
  return parsed;
}

std::optional<std::string_view> BagFields::find(std::string_view name) const {
  for (const auto& [known, value] : fields_) {
    if (known == name) return value;
  }
  return std::nullopt;
}

Bytes unpack(BagPacking packing, Bytes packed, std::size_t size) {
  switch (packing) {
    case BagPacking::Bz2:
      return unpackBz2(packed, size);
    case BagPacking::Lz4:
      return unpackLz4(packed, size);
    case BagPacking::None:
      break;
  }
  if (packed.size() != size) throw BagDamage("has a damaged size");
  return packed;
}

BagChunk::BagChunk(Bytes bytes) : bytes_(std::move(bytes)) {
  std::size_t at = 0;
  const auto lengthAt = [&](const char* of) -> std::size_t {
    if (bytes_.size() - at < 4) throw BagDamage("ends within a length");
    const std::size_t length = loadNumber<std::uint32_t>(bytes_.data() + at);
    at += 4;
    if (length > bytes_.size() - at) {
      throw BagDamage(std::string("holds ") + of + " at its byte " + std::to_string(at) +
                      " that reaches beyond the chunk");
    }
    return length;
  };
  while (at < bytes_.size()) {
    Message message;
    message.offset = static_cast<std::uint32_t>(at);
    const std::size_t header_size = lengthAt("a record header");
    const auto fields = BagFields::parse(bytes_.data() + at, header_size);
    at += header_size;
    message.size = lengthAt("a record");
    message.begin = at;
    at += message.size;
    const auto kind = fields ? fields->number<std::uint8_t>("op") : std::nullopt;
    const auto connection = fields ? fields->number<std::uint32_t>("conn") : std::nullopt;
    const bool is_message = kind == static_cast<std::uint8_t>(BagRecord::MessageData);
    const bool is_connection = kind == static_cast<std::uint8_t>(BagRecord::Connection);
    if (!connection || (!is_message && !is_connection)) {
      throw BagDamage("holds a damaged record at its byte " + std::to_string(message.offset));
    }
    message.connection = *connection;
    message.time = fields->number<std::uint64_t>("time");
    if (is_message) messages_.push_back(message);
  }
}

const BagChunk::Message* BagChunk::find(std::uint32_t offset) const {
  const auto found = std::lower_bound(
      messages_.begin(), messages_.end(), offset,
      [](const Message& message, std::uint32_t wanted) { return message.offset < wanted; });
  return found != messages_.end() && found->offset == offset ? &*found : nullptr;
}

Bytes BagChunk::data(const Message& message) const {
  const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(message.begin);
  return Bytes(begin, begin + static_cast<std::ptrdiff_t>(message.size));
}

}  // namespace afterglow::replay
