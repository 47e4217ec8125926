// SPDX-License-Identifier: Apache-2.0
#include "host/view/compare.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/quality.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {

namespace {

struct CompareArguments {
  std::string a, b, out, blur, pitch, domain = "intensity";
  std::vector<int> region;
  int border_px = 0;
  bool levels = false;
  ReportOptions report;
};

enum class Kind { field, picture };

Kind kind_of(const std::filesystem::path& file, bool png_holds_levels) {
  const auto extension = extension_of(file);
  if (extension == ".npy") return Kind::field;
  if (extension == ".png") return png_holds_levels ? Kind::field : Kind::picture;
  if (extension == ".exr") return Kind::picture;
  throw InputError(in_quotes(file.string()) + ": must be a field (.npy) or a picture (.png, .exr)");
}

/// A field, or what the levels of a picture show, 256 to a turn.
FieldStack load_field(const std::filesystem::path& file) {
  if (extension_of(file) == ".npy") return load_npy(file);
  glm::ivec2 size;
  SlmSpec slm;
  slm.encoding = Encoding::phase;
  const std::vector<std::vector<std::uint8_t>> frames{load_hologram_levels(file, slm, &size)};
  return shown_field(Panel(slm, size, glm::dvec2(1), 1), frames);
}

double blur_px(const CompareArguments& options) {
  if (options.blur.empty()) return 0;
  const auto blur = parse_blur(options.blur);
  if (blur.in_pixels) return blur.value;
  if (options.pitch.empty())
    throw InputError("--blur " + in_quotes(options.blur) +
                     ": --pitch is needed too, or pixels, as in 4px");
  return blur.value / positive_length_m(options.pitch, "--pitch");
}

void print_field_table(const FieldStack& a, const FieldComparison& c) {
  std::printf("fields             %d x %d, %d %s\n", a.nx, a.ny, a.frames,
              a.frames == 1 ? "frame" : "frames, averaged");
  std::printf("correlation        %.6f\n", c.correlation);
  std::printf("relative L2 error  %.4g\n", c.error);
  std::printf("  B scaled best    %.4g\n", c.error_scaled);
  std::printf("energy of B / A    %.6g\n", c.energy_ratio);
}

/// Pictures that are compared by their luminances, where one of them is in colour.
struct Compared {
  ColourComparison figures;  // of grey pictures, the luminance alone
  bool in_colour = false;
  int width = 0, height = 0;
};

/// Whether a picture is in colour; not where its reading fails (which load_grey tells).
bool is_in_colour(const std::string& file) {
  try {
    return !is_grey(load_rgb(file, ""));
  } catch (const InputError&) {
    return false;
  }
}

Compared compare_files(const std::string& a, const std::string& b, const PictureOptions& how) {
  if (is_in_colour(a) || is_in_colour(b)) {
    const auto reference = load_rgb(a, "");
    return {compare_colours(reference, load_rgb(b, ""), how), true, reference.width(),
            reference.height()};
  }
  const auto reference = load_grey(a, "");
  Compared grey{{}, false, reference.width, reference.height};
  grey.figures.luminance = compare_pictures(reference, load_grey(b, ""), how);
  return grey;
}

void print_picture_table(const Compared& compared, const PictureOptions& how) {
  const auto& c = compared.figures.luminance;
  std::printf("pictures           %d x %d, blur %.4g px, border %d px, compared as %s\n",
              compared.width, compared.height, how.blur_px, how.border_px, name_of(how.domain));
  std::printf("PSNR               %.2f dB\n", c.psnr_db);
  std::printf("SSIM               %.4f\n", c.ssim);
  std::printf("FLIP               %.4f\n", c.flip);
  std::printf("scale of B to A    %.6g\n", c.scale);
  std::printf("speckle contrast   A %.4f, B %.4f", c.contrast_a, c.contrast_b);
  if (how.region)
    std::printf(" in %d x %d pixels from (%d, %d)\n", how.region->width, how.region->height,
                how.region->x, how.region->y);
  else
    std::printf("\n");
  if (!compared.in_colour) return;
  std::printf("                   (of the luminances, but for FLIP)\n");
  std::printf("Delta E 2000       mean %.3f, median %.3f, 95 %% within %.3f, largest %.3f\n",
              compared.figures.mean, compared.figures.median, compared.figures.most_of_95,
              compared.figures.most);
}

Json json_of(const Compared& compared, const PictureOptions& how) {
  const auto& c = compared.figures.luminance;
  Json json{{"kind", compared.in_colour ? "colour pictures" : "pictures"},
            {"size", {compared.width, compared.height}},
            {"blur_px", how.blur_px},
            {"border_px", how.border_px},
            {"domain", name_of(how.domain)},
            {"psnr_db", c.psnr_db},  // null when infinite
            {"ssim", c.ssim},
            {"flip", c.flip},
            {"scale", c.scale},
            {"speckle_contrast", {{"a", c.contrast_a}, {"b", c.contrast_b}}}};
  if (how.region)
    json["region"] = {how.region->x, how.region->y, how.region->width, how.region->height};
  if (compared.in_colour) json["delta_e_2000"] = delta_e_json(compared.figures);
  return json;
}

void run_compare(const CompareArguments& options) {
  const Domain domain = choice_of<Domain>(options.domain, "domain");
  const Kind kind = kind_of(options.a, options.levels);
  if (kind_of(options.b, options.levels) != kind) {
    throw InputError(
        in_quotes(options.a) + " and " + in_quotes(options.b) +
        ": a field and a picture cannot be compared (--levels: PNGs hold the levels of holograms)");
  }
  Json json;
  Image difference;
  if (kind == Kind::field) {
    if (!options.blur.empty() || options.border_px != 0 || !options.region.empty() ||
        domain != Domain::intensity)
      throw InputError("--blur, --border, --region and --domain are for pictures, not for fields");
    const auto a = load_field(options.a), b = load_field(options.b);
    auto comparison = compare_fields(a, b);
    json = {{"kind", "fields"}, {"size", {a.nx, a.ny}}, {"frames", a.frames}};
    json.update(raywave::json_of(comparison));
    if (options.report.prints_text()) print_field_table(a, comparison);
    difference = std::move(comparison.difference);
  } else {
    PictureOptions how{blur_px(options), options.border_px, {}, domain};
    if (!options.region.empty())
      how.region =
          Region{options.region[0], options.region[1], options.region[2], options.region[3]};
    auto compared = compare_files(options.a, options.b, how);
    json = json_of(compared, how);
    if (options.report.prints_text()) print_picture_table(compared, how);
    difference = std::move(compared.figures.luminance.difference);
  }
  if (!options.out.empty()) {
    const auto file = std::filesystem::path(options.out) / "difference.png";
    const double full = largest_magnitude(difference);
    save_picture(file, difference.width, difference.height, diverging_colours(difference, full));
    json["difference"] = {{"file", file.string()}, {"full_colour", full}};
    if (options.report.prints_text()) {
      const char* meaning = kind == Kind::field
                                ? "white where scaled B equals A, full red at"
                                : "red where scaled B is brighter, blue where darker, full at";
      std::printf("difference         %s: %s %.4g\n", file.c_str(), meaning, full);
    }
  }
  options.report.write(json);
}

}  // namespace

void add_compare(CLI::App& app) {
  auto* command =
      add_command(app, section::look, "compare", "Measure how alike two fields or two pictures are",
                  "build/raywave render data/study.toml -o out\n"
                  "build/raywave reconstruct out/field.npy -z 18.55mm -o out\n"
                  "build/raywave lens data/study.toml -z 18.55mm -o out --lens-points 8\n"
                  "build/raywave compare out/lens_18.55mm.exr out/reconstruction_18.55mm.exr "
                  "--blur 4px");
  const auto options = arguments_of(*command, run_compare);
  argument(*command, "A", options->a, "FILE",
           "Reference: field (.npy) or grey picture (.png in sRGB, .exr linear)")
      ->required();
  argument(*command, "B", options->b, "FILE", "What is judged, of the same kind and size")
      ->required();
  flag(*command, "--levels", options->levels, group::pictures,
       "PNGs hold the levels of phase holograms: compare them as fields");
  add_blur(*command, options->blur, "none");
  auto* blur = command->get_option("--blur");
  option(*command, "--pitch", options->pitch, "LENGTH", group::pictures,
         "Pixel pitch, for a blur that is a length")
      ->needs(blur);
  add_border(*command, options->border_px);
  option(*command, "--domain", options->domain, "intensity|amplitude|srgb", group::pictures,
         "What pixels are compared as: linear values, their square roots, or values "
         "encoded for a screen")
      ->capture_default_str();
  option(*command, "--region", options->region, "X,Y,WIDTH,HEIGHT", group::pictures,
         "Part for the speckle contrast, in pixels: x,y,width,height")
      ->delimiter(',')
      ->expected(4);
  add_output(*command, options->out, "difference.png");
  options->report.add_to(*command, "the figures");
}

}  // namespace raywave::cli
