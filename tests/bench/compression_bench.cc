// compression_bench IMAGE.png...: how much smaller images of the cameras become without loss, and how fast,
// on one core. Compared are coders with and without a predictor (each pixel less its left neighbour).
#include <libdeflate.h>
#include <lz4.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace {

using Bytes = std::vector<std::uint8_t>;

struct Image {
  std::size_t width_px;
  Bytes pixels;
};

struct Coder {
  std::string name;
  bool predict;
  std::function<std::size_t(const Bytes& from, Bytes& to)> encode;  // bytes written, 0 = failed
  std::function<std::size_t(const std::uint8_t* from, std::size_t size, Bytes& to)> decode;
};

// Of computing by this thread: what else runs on the machine does not count.
double Seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void Predict(const Image& image, Bytes& residual) {
  residual.resize(image.pixels.size());
  for (std::size_t row = 0; row < image.pixels.size(); row += image.width_px) {
    residual[row] = image.pixels[row];
    for (std::size_t x = 1; x < image.width_px; ++x) {
      residual[row + x] = static_cast<std::uint8_t>(image.pixels[row + x] - image.pixels[row + x - 1]);
    }
  }
}

void Restore(std::size_t width_px, Bytes& pixels) {
  for (std::size_t row = 0; row < pixels.size(); row += width_px) {
    for (std::size_t x = 1; x < width_px; ++x) {
      pixels[row + x] = static_cast<std::uint8_t>(pixels[row + x] + pixels[row + x - 1]);
    }
  }
}

Coder Zstd(int level, bool predict) {
  return {"zstd -" + std::to_string(level), predict,
          [level](const Bytes& from, Bytes& to) {
            const std::size_t size = ZSTD_compress(to.data(), to.size(), from.data(), from.size(), level);
            return ZSTD_isError(size) != 0 ? 0 : size;
          },
          [](const std::uint8_t* from, std::size_t size, Bytes& to) {
            const std::size_t got = ZSTD_decompress(to.data(), to.size(), from, size);
            return ZSTD_isError(got) != 0 ? 0 : got;
          }};
}

Coder Lz4(bool predict) {
  return {
      "LZ4", predict,
      [](const Bytes& from, Bytes& to) {
        return static_cast<std::size_t>(
            std::max(0, LZ4_compress_default(reinterpret_cast<const char*>(from.data()),
                                             reinterpret_cast<char*>(to.data()),
                                             static_cast<int>(from.size()), static_cast<int>(to.size()))));
      },
      [](const std::uint8_t* from, std::size_t size, Bytes& to) {
        return static_cast<std::size_t>(std::max(
            0, LZ4_decompress_safe(reinterpret_cast<const char*>(from), reinterpret_cast<char*>(to.data()),
                                   static_cast<int>(size), static_cast<int>(to.size()))));
      }};
}

Coder Deflate(int level, bool predict) {
  return {"deflate -" + std::to_string(level), predict,
          [level](const Bytes& from, Bytes& to) {
            libdeflate_compressor* compressor = libdeflate_alloc_compressor(level);
            const std::size_t size =
                libdeflate_deflate_compress(compressor, from.data(), from.size(), to.data(), to.size());
            libdeflate_free_compressor(compressor);
            return size;
          },
          [](const std::uint8_t* from, std::size_t size, Bytes& to) {
            libdeflate_decompressor* decompressor = libdeflate_alloc_decompressor();
            std::size_t got = 0;
            const auto result =
                libdeflate_deflate_decompress(decompressor, from, size, to.data(), to.size(), &got);
            libdeflate_free_decompressor(decompressor);
            return result == LIBDEFLATE_SUCCESS ? got : 0;
          }};
}

// Bits a pixel that a perfect coder of single values would need.
double Entropy(const Bytes& bytes) {
  std::array<double, 256> count{};
  for (const std::uint8_t value : bytes) {
    ++count[value];
  }
  double bits = 0;
  for (const double one : count) {
    const double share = one / static_cast<double>(bytes.size());
    bits -= one > 0 ? share * std::log2(share) : 0;
  }
  return bits;
}

// One line of the table; false if an image does not come back as it was.
bool Measure(const std::vector<Image>& images, const Coder& coder) {
  double raw_bytes = 0, packed_bytes = 0, encode_s = 0, decode_s = 0;
  Bytes residual, packed, back;
  for (const Image& image : images) {
    packed.resize(image.pixels.size() + image.pixels.size() / 8 + 65'536);
    back.resize(image.pixels.size());
    const double start = Seconds();
    if (coder.predict) {
      Predict(image, residual);
    }
    const std::size_t size = coder.encode(coder.predict ? residual : image.pixels, packed);
    const double encoded = Seconds();
    const std::size_t got = coder.decode(packed.data(), size, back);
    if (coder.predict) {
      Restore(image.width_px, back);
    }
    decode_s += Seconds() - encoded;
    encode_s += encoded - start;
    if (size == 0 || got != image.pixels.size() || back != image.pixels) {
      return false;
    }
    raw_bytes += static_cast<double>(image.pixels.size());
    packed_bytes += static_cast<double>(size);
  }
  std::printf("%-12s %-6s %6.2f %10.0f %10.0f\n", coder.name.c_str(), coder.predict ? "left" : "none",
              raw_bytes / packed_bytes, raw_bytes * 1e-6 / encode_s, raw_bytes * 1e-6 / decode_s);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Image> images;
  double bits = 0;
  for (int i = 1; i < argc; ++i) {
    const cv::Mat read = cv::imread(argv[i], cv::IMREAD_GRAYSCALE);
    if (read.empty() || !read.isContinuous()) {
      std::fprintf(stderr, "compression_bench: %s is no image\n", argv[i]);
      return 1;
    }
    images.push_back({static_cast<std::size_t>(read.cols), Bytes(read.data, read.data + read.total())});
    Bytes residual;
    Predict(images.back(), residual);
    bits += Entropy(residual) / (argc - 1);
  }
  if (images.empty()) {
    std::fprintf(stderr, "usage: compression_bench IMAGE.png...\n");
    return 2;
  }
  std::printf("%zu images of %zu bytes; a perfect coder of single residuals: %.2f\n\n", images.size(),
              images[0].pixels.size(), 8 / bits);
  std::printf("%-12s %-6s %6s %10s %10s   (MB/s of images, one core)\n", "coder", "predict", "ratio",
              "encode", "decode");
  bool whole = true;
  for (const bool predict : {false, true}) {
    for (const Coder& coder :
         {Lz4(predict), Zstd(-1, predict), Zstd(1, predict), Zstd(3, predict), Deflate(1, predict)}) {
      whole = Measure(images, coder) && whole;
    }
  }
  if (!whole) {
    std::fprintf(stderr, "compression_bench: an image did not come back as it was\n");
  }
  return whole ? 0 : 1;
}
