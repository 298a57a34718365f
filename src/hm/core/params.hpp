#pragma once
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "hm/core/param_doc.hpp"
#include "hm/core/result.hpp"

namespace hm {

/// Enumeration as a parameter: names of the enumerators in the order of their values (0, 1, 2 ...), and
/// type-erased access.
struct ChoiceRef {
  std::span<const std::string_view> names;
  void* member = nullptr;
  int (*read)(const void*) = nullptr;
  void (*write)(void*, int) = nullptr;
  [[nodiscard]] int get() const { return read(member); }
  void set(int value) const { write(member, value); }
};

/// One parameter of a running program: full name ("tsdf.voxel_size_m"), range, help, and a pointer to its
/// value.
struct ParamRef {
  std::string name;
  Range range;
  std::string help;
  ParamLevel level = ParamLevel::kExpert;
  std::variant<double*, float*, int*, bool*, std::string*, ChoiceRef> value;
};

/// All parameters of a program, as references into plain structs, for reading, writing, validation and
/// documentation.
///
/// A parameter struct is an aggregate with defaults and one static template member function:
///
///     struct TsdfParams {
///       double voxel_size_m = 0.02;
///       Weighting weighting = Weighting::kConstant;
///       template <class Self, class Visitor>
///       static void visit(Self& self, Visitor&& v) {
///         v(ParamDoc{"voxel_size_m", {0.001, 1.0}, "edge of a voxel"}, self.voxel_size_m);
///         v(ParamDoc{"weighting", {}, "weight of an observation"}, self.weighting, kWeightingNames);
///       }
///     };
///
/// The structs must outlive the list.
class ParamList {
 public:
  template <class Struct>
  void add(std::string_view section, Struct& params);
  /// Adds the parameters of another list that this one lacks, and its renamed names.
  void add_missing(const ParamList& other);

  /// Registers a name of an earlier version: setting it is an error that gives the new name. A name without a
  /// dot is a section.
  void add_renamed(std::string_view old_name, std::string_view new_name);

  [[nodiscard]] std::span<const ParamRef> all() const { return params_; }
  [[nodiscard]] const ParamRef* find(std::string_view name) const;

  /// Sets one parameter from "section.key=value". An unknown key is an error that suggests the nearest valid
  /// one.
  Result<void> set(std::string_view assignment);
  /// Reads a TOML text; `where` names the source in errors. All violations are reported at once, with their
  /// lines; nothing is changed if there are any.
  Result<void> read_toml(std::string_view text, const std::string& where);
  Result<void> read_toml_file(const std::string& path);
  /// Checks every value against its range; reports all violations in one error.
  [[nodiscard]] Result<void> check() const;
  /// TOML text of the parameters of this level and above, each with a comment (help, range); readable by
  /// read_toml.
  [[nodiscard]] std::string to_toml(ParamLevel least = ParamLevel::kExpert) const;

 private:
  [[nodiscard]] std::string unknown_name(std::string_view name) const;

  std::vector<ParamRef> params_;
  std::vector<std::pair<std::string, std::string>> renamed_;
};

/// Size limit of parameter, calibration and rig files.
inline constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20U;

/// Checks TOML text before a parser sees it: at most kMaxTomlBytes, at most eight dots in a key, brackets
/// nested at most 32 deep. The parser frees its tables recursively, so a key with 40,000 dots would overflow
/// the stack. Does not check TOML syntax otherwise.
Result<void> check_toml_text(std::string_view text, const std::string& where);

/// Value of a parameter in TOML syntax.
std::string value_text(const ParamRef& param);

// ---- implementation of the template ----
namespace detail {
struct ParamCollector {
  std::string_view section;
  std::vector<ParamRef>& out;
  template <class T>
  void operator()(const ParamDoc& doc, T& member) {
    out.push_back({std::string(section) + "." + std::string(doc.name), doc.range, std::string(doc.help),
                   doc.level, &member});
  }
  template <class Enum>
  void operator()(const ParamDoc& doc, Enum& member, std::span<const std::string_view> names) {
    const ChoiceRef choice{
        names, &member, [](const void* place) { return static_cast<int>(*static_cast<const Enum*>(place)); },
        [](void* place, int index) { *static_cast<Enum*>(place) = static_cast<Enum>(index); }};
    out.push_back({std::string(section) + "." + std::string(doc.name), doc.range, std::string(doc.help),
                   doc.level, choice});
  }
};
}  // namespace detail

template <class Struct>
void ParamList::add(std::string_view section, Struct& params) {
  Struct::visit(params, detail::ParamCollector{section, params_});
}

}  // namespace hm
