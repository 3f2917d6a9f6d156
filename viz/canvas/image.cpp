// SPDX-License-Identifier: BSD-3-Clause
#include "canvas/image.hpp"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <string>

#include "plumbline/core/output_file.hpp"

namespace plumbline::viz {
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
    return core::output_error(file.string() + ": the picture cannot be encoded as PNG");
  }
  auto* bytes = writer->GetResult();
  return core::write_file(file, {reinterpret_cast<const char*>(bytes->GetPointer(0)),
                                 static_cast<std::size_t>(bytes->GetNumberOfValues())});
}

}  // namespace plumbline::viz
