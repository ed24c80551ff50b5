#include "viz/images/png.h"

#include <cairo.h>

#include <memory>

#include "base/errors.h"

namespace evalbus::viz {

void WritePng(const Frame& frame, const std::filesystem::path& file) {
  const int stride = 4 * frame.size.width;
  // The const_cast is safe: Cairo only reads the pixels.
  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface(
      cairo_image_surface_create_for_data(const_cast<uint8_t*>(frame.bgrx.data()), CAIRO_FORMAT_RGB24,
                                          frame.size.width, frame.size.height, stride),
      cairo_surface_destroy);
  const cairo_status_t status = cairo_surface_write_to_png(surface.get(), file.c_str());
  if (status != CAIRO_STATUS_SUCCESS) {
    throw InputError("cannot write " + file.string() + ": " + cairo_status_to_string(status));
  }
}

}  // namespace evalbus::viz
