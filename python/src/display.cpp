// SPDX-License-Identifier: Apache-2.0
#include "convert.hpp"

namespace raywave_python {

void add_display(nb::module_& m) {
  nb::class_<raywave::Display>(m, "Display")
      .def(
          "__init__",
          [](raywave::Display* self, int columns, int rows, const std::string& output,
             const std::string& backend, double rate, bool read_back) {
            new (self) raywave::Display(columns, rows, {output, backend, rate, read_back});
          },
          "columns"_a, "rows"_a, "output"_a, "backend"_a, "rate"_a, "read_back"_a)
      .def(
          "show",
          [](raywave::Display& display, nb::handle levels) {
            const auto array = array_of(levels, "levels", 2, 3, pictures);
            const auto* const bytes = data_of<std::uint8_t>(array, "levels");
            const auto flip = without_gil([&] { return display.show({bytes, array.size()}); });
            return std::tuple(flip.refresh, flip.time_s, flip.latency_s);
          },
          "levels"_a)
      .def("report", &raywave::Display::report)
      .def("close", &raywave::Display::close);
}

}  // namespace raywave_python
