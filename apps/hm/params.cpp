#include "hm/pipeline/common/parameters.hpp"

#include <memory>

#include "program.hpp"

namespace {

struct ParamsFlags {
  std::string name, file, other;
  bool markdown = false;
};

hm::JsonValue as_json(const hm::ParamList& list) {
  auto json = hm::JsonValue::object();
  for (const hm::ParamRef& param : list.all()) json[param.name] = hm::value_text(param);
  return json;
}

hm::Result<Outcome> show(const ParamsFlags& flags, Session& session) {
  hm::Parameters parameters;
  auto list = hm::list_all(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  Outcome outcome;
  outcome.text = flags.markdown ? hm::to_markdown(list) : list.to_toml();
  outcome.json["parameters"] = as_json(list);
  return outcome;
}

/// Parameter files are configuration: what is wrong with them is a usage error.
hm::Result<void> read(hm::Parameters& parameters, const std::string& path) {
  auto list = hm::list_all(parameters);
  auto result = list.read_toml_file(path);
  if (result) result = hm::check_parameters(parameters);
  if (!result) result.error().code = hm::ErrorCode::kUsage;
  return result;
}

hm::Result<Outcome> check(const ParamsFlags& flags) {
  hm::Parameters parameters;
  if (const auto result = read(parameters, flags.file); !result) return hm::forward_error(result);
  Outcome outcome;
  outcome.text = flags.file + ": good\n";
  return outcome;
}

hm::Result<Outcome> explain(const ParamsFlags& flags) {
  hm::Parameters parameters;
  const auto list = hm::list_all(parameters);
  Outcome outcome;
  for (const hm::ParamRef& param : list.all()) {
    const std::size_t dot = param.name.find('.');
    if (param.name != flags.name && param.name.substr(0, dot) != flags.name &&
        param.name.substr(dot + 1) != flags.name)
      continue;
    outcome.text += hm::explain(param);
    outcome.json["parameters"][param.name] =
        hm::JsonValue::object({{"value", hm::value_text(param)}, {"help", param.help}});
  }
  if (!outcome.text.empty()) return outcome;
  // Setting it fails with the words that name the nearest one.
  auto unknown = hm::list_all(parameters).set(flags.name + "=0");
  return hm::fail(hm::ErrorCode::kUsage, {}, "{}", unknown ? "unknown parameter" : unknown.error().message);
}

hm::Result<Outcome> diff(const ParamsFlags& flags) {
  hm::Parameters a, b;
  if (const auto result = read(a, flags.file); !result) return hm::forward_error(result);
  if (const auto result = read(b, flags.other); !result) return hm::forward_error(result);
  const auto of_a = hm::list_all(a), of_b = hm::list_all(b);
  Outcome outcome;
  outcome.json["differences"] = hm::JsonValue::object();
  for (std::size_t i = 0; i < of_a.all().size(); ++i) {
    const std::string left = hm::value_text(of_a.all()[i]), right = hm::value_text(of_b.all()[i]);
    if (left == right) continue;
    outcome.text += fmt::format("{}: {} -> {}\n", of_a.all()[i].name, left, right);
    outcome.json["differences"][of_a.all()[i].name] = hm::JsonValue::object({{"a", left}, {"b", right}});
  }
  if (outcome.text.empty()) outcome.text = "no difference\n";
  return outcome;
}

}  // namespace

void add_params(Program& program) {
  program.add({"params",
               "Show, check, explain, compare parameters.",
               "  hm params show\n"
               "  hm params explain tsdf.voxel_size_m\n"
               "  hm params check result/parameters.toml",
               {}});
  auto flags = std::make_shared<ParamsFlags>();
  CLI::App& show_command = program.add(
      {"params show", "All parameters as TOML, with --params and --set applied.",
       "  hm params show\n  hm params show --set tsdf.voxel_size_m=0.01\n  hm params show --markdown",
       [flags](Session& session) { return show(*flags, session); }});
  show_command.add_flag("--markdown", flags->markdown, "as the tables of docs/parameters.md");
  program
      .add({"params check", "Whether a parameter file is good, and every line that is not.",
            "  hm params check result/parameters.toml", [flags](Session&) { return check(*flags); }})
      .add_option("file", flags->file, "TOML file")
      ->required();
  program
      .add({"params explain", "What a parameter, or a section of them, does.",
            "  hm params explain tsdf.far_m\n  hm params explain mesh",
            [flags](Session&) { return explain(*flags); }})
      .add_option("name", flags->name, "section.key, section, or key")
      ->required();
  CLI::App& diff_command = program.add({"params diff", "What differs between two parameter files.",
                                        "  hm params diff result/parameters.toml other/parameters.toml",
                                        [flags](Session&) { return diff(*flags); }});
  diff_command.add_option("a", flags->file, "TOML file")->required();
  diff_command.add_option("b", flags->other, "TOML file")->required();
}
