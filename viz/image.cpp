// SPDX-License-Identifier: BSD-3-Clause
#include "image.hpp"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

namespace plumbline::viz {
namespace {

core::Error cannot_write(const std::filesystem::path& file, const std::string& reason) {
  return {core::ErrorKind::kOutput, "cannot write " + file.string() + ": " + reason};
}

}  // namespace

Image downsample(const Image& image, int factor) {
  if (factor == 1) return image;
  Image small;
  small.width = image.width / factor;
  small.height = image.height / factor;
  small.rgb.resize(3 * static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height));
  const auto stride = 3 * static_cast<std::size_t>(image.width);
  const auto n = static_cast<std::size_t>(factor);
  std::size_t out = 0;
  for (std::size_t y = 0; y < static_cast<std::size_t>(small.height); ++y) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(small.width); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        std::size_t sum = 0;
        for (std::size_t dy = 0; dy < n; ++dy) {
          for (std::size_t dx = 0; dx < n; ++dx) {
            sum += image.rgb[(y * n + dy) * stride + (x * n + dx) * 3 + c];
          }
        }
        small.rgb[out++] = static_cast<std::uint8_t>((sum + n * n / 2) / (n * n));
      }
    }
  }
  return small;
}

core::Result<void> write_bytes(std::string_view bytes, const std::filesystem::path& file) {
  const std::filesystem::path partial = file.string() + ".partial";
  std::ofstream out(partial, std::ios::binary | std::ios::trunc);
  if (!out) return tl::unexpected(cannot_write(file, std::strerror(errno)));
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  std::error_code problem;
  if (!out) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "write failed";
    std::filesystem::remove(partial, problem);
    return tl::unexpected(cannot_write(file, reason));
  }
  std::filesystem::rename(partial, file, problem);
  if (problem) {
    const std::string reason = problem.message();
    std::filesystem::remove(partial, problem);
    return tl::unexpected(cannot_write(file, reason));
  }
  return {};
}

core::Result<void> write_png(const Image& image, const std::filesystem::path& file) {
  vtkNew<vtkImageData> data;
  data->SetDimensions(image.width, image.height, 1);
  data->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  std::copy(image.rgb.begin(), image.rgb.end(), static_cast<std::uint8_t*>(data->GetScalarPointer()));
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(data);
  writer->SetCompressionLevel(6);
  writer->WriteToMemoryOn();
  writer->Write();
  const vtkUnsignedCharArray* result = writer->GetResult();
  if (result == nullptr || result->GetNumberOfValues() == 0) {
    return tl::unexpected(cannot_write(file, "the picture cannot be encoded as PNG"));
  }
  auto* bytes = writer->GetResult();
  return write_bytes({reinterpret_cast<const char*>(bytes->GetPointer(0)),
                      static_cast<std::size_t>(bytes->GetNumberOfValues())},
                     file);
}

}  // namespace plumbline::viz
