// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/console/print.h>

#include "bindings.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::python {

void add_errors(py::module_& module) {
  // Python's exceptions by kind of error
  static const py::exception<Failure> base(module, "Error");
  static const py::exception<Failure> internal(module, "InternalError", base);
  static const py::exception<Failure> config(module, "ConfigError", base);
  static const py::exception<Failure> input(module, "InputError", base);
  static const py::exception<Failure> untrustworthy(module, "UntrustworthyError", base);
  static const py::exception<Failure> output(module, "OutputError", base);

  // A Failure becomes the exception of its kind
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Failure& failure) {
      // A run that was stopped is a plain Error
      const auto kind = failure.error.kind;
      const py::handle type = kind == core::ErrorKind::kUsage           ? config
                              : kind == core::ErrorKind::kInput         ? input
                              : kind == core::ErrorKind::kUntrustworthy ? untrustworthy
                              : kind == core::ErrorKind::kOutput        ? output
                              : kind == core::ErrorKind::kStopped       ? base
                                                                        : internal;
      PyErr_SetString(type.ptr(), failure.what());
    }
  });
}

}  // namespace plumbline::python

PYBIND11_MODULE(_core, module) {
  using namespace plumbline;
  module.doc() = "Parts of plumbline's Python classes; use those classes.";
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // the step that called PCL reports failures

  module.attr("version") = core::version();
  module.attr("store_format") = maps::kStoreFormat;
  python::add_errors(module);
  python::add_cameras(module);
  python::add_recordings(module);
  python::add_runs(module);
  python::add_clouds(module);
  python::add_maps(module);
  python::add_measures(module);
}
