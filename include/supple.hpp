#ifndef SUPPLE_HPP
#define SUPPLE_HPP

// supple for C++17: the functions of supple.h with types, and nothing else. Nothing is allocated, nothing throws,
// nothing is virtual. Objects live in memory of the host; scene, loads, state and the kinds of steps only point to
// them: copy them like pointers, there is nothing to release, but the memory must stay as long as they are used.
// Units are SI: m, kg, s, N, Pa, J. What a call does in detail stands in supple.h.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <type_traits>
#include <utility>

#include "supple.h"

namespace supple {

// No node, element or axis.
inline constexpr std::uint32_t none = SUPPLE_NONE;
// Memory of objects begins at a multiple of so many bytes.
inline constexpr std::size_t align = SUPPLE_ALIGN;

using support = supple_support;
using tissue = supple_tissue;
// How a tissue relaxes.
using prony = supple_prony;
// The fibres of a tissue.
using fibres = supple_fibres;
using force = supple_force;
using motion = supple_motion;
using threads = supple_threads;
using report = supple_report;
using settled = supple_settled;
using scene_facts = supple_scene_facts;
using learned_facts = supple_learned_facts;
using estimate = supple_estimate;
using adaptive_report = supple_adaptive_report;
using sim_report = supple_sim_report;
using reaction_force = supple_reaction_force;
// A point that follows the tissue, and the grid of an image.
using followed_point = supple_followed_point;
using image_grid = supple_image_grid;
// Where an instrument is, what it feels, and where it pushes.
using pose = supple_pose;
using touch = supple_touch;
using contact_point = supple_contact_point;
// What looks as if a unit or a number was mistaken; `text` says what it means.
using remark = supple_remark;
// Where and with which value something went wrong; `describe` makes a sentence of it.
using error = supple_error;

// Memory in pieces that are aligned for objects: std::vector<line> of so many `lines`.
struct alignas(align) line {
    unsigned char bytes[align];
};
[[nodiscard]] constexpr std::size_t lines(std::size_t bytes) noexcept { return (bytes + align - 1) / align; }

// What became of a call: zero is done, positive done with a remark, negative not done. See supple_status.
enum class [[nodiscard]] status : std::int32_t {
    ok = SUPPLE_OK,
    limited = SUPPLE_LIMITED,
    outside = SUPPLE_OUTSIDE,
    fell_back = SUPPLE_FELL_BACK,
    inexact = SUPPLE_INEXACT,
    behind = SUPPLE_BEHIND,

    e_null = SUPPLE_E_NULL,
    e_misaligned = SUPPLE_E_MISALIGNED,
    e_short = SUPPLE_E_SHORT,
    e_abi = SUPPLE_E_ABI,
    e_not_initialised = SUPPLE_E_NOT_INITIALISED,
    e_kind = SUPPLE_E_KIND,
    e_choice = SUPPLE_E_CHOICE,
    e_mismatch = SUPPLE_E_MISMATCH,
    e_capacity = SUPPLE_E_CAPACITY,
    e_index = SUPPLE_E_INDEX,
    e_not_finite = SUPPLE_E_NOT_FINITE,
    e_negative = SUPPLE_E_NEGATIVE,
    e_overlap = SUPPLE_E_OVERLAP,
    e_element = SUPPLE_E_ELEMENT,
    e_points = SUPPLE_E_POINTS,
#ifdef SUPPLE_IO
    e_file = SUPPLE_E_FILE,
#endif

    e_mesh_empty = SUPPLE_E_MESH_EMPTY,
    e_mesh_repeated_node = SUPPLE_E_MESH_REPEATED_NODE,
    e_mesh_degenerate = SUPPLE_E_MESH_DEGENERATE,
    e_mesh_inverted = SUPPLE_E_MESH_INVERTED,
    e_mesh_unused_node = SUPPLE_E_MESH_UNUSED_NODE,
    e_constant = SUPPLE_E_CONSTANT,
    e_density = SUPPLE_E_DENSITY,
    e_tissue = SUPPLE_E_TISSUE,
    e_nothing_moves = SUPPLE_E_NOTHING_MOVES,
    e_law = SUPPLE_E_LAW,

    e_not_held = SUPPLE_E_NOT_HELD,
    e_no_step = SUPPLE_E_NO_STEP,
    e_step = SUPPLE_E_STEP,
    e_unstable = SUPPLE_E_UNSTABLE,
    e_instrument = SUPPLE_E_INSTRUMENT,
    e_field = SUPPLE_E_FIELD,
    e_pull = SUPPLE_E_PULL,
    e_no_nodes = SUPPLE_E_NO_NODES,
    e_relaxation_share = SUPPLE_E_RELAXATION_SHARE,
    e_relaxation_time = SUPPLE_E_RELAXATION_TIME,

    e_weights_misaligned = SUPPLE_E_WEIGHTS_MISALIGNED,
    e_weights_short = SUPPLE_E_WEIGHTS_SHORT,
    e_not_weights = SUPPLE_E_NOT_WEIGHTS,
    e_weights_version = SUPPLE_E_WEIGHTS_VERSION,
    e_weights_checksum = SUPPLE_E_WEIGHTS_CHECKSUM,
    e_weights_content = SUPPLE_E_WEIGHTS_CONTENT,
    e_weights_shape = SUPPLE_E_WEIGHTS_SHAPE,

    e_not_led = SUPPLE_E_NOT_LED,
    e_step_ratio = SUPPLE_E_STEP_RATIO,
    e_damping = SUPPLE_E_DAMPING,

    e_lattice = SUPPLE_E_LATTICE,
    e_too_stiff = SUPPLE_E_TOO_STIFF,
    e_fibres = SUPPLE_E_FIBRES,
    e_direction = SUPPLE_E_DIRECTION,

    e_not_saved = SUPPLE_E_NOT_SAVED,
    e_saved_version = SUPPLE_E_SAVED_VERSION,
    e_saved_checksum = SUPPLE_E_SAVED_CHECKSUM,

    e_level = SUPPLE_E_LEVEL,

    e_grid = SUPPLE_E_GRID,

    e_diverged = SUPPLE_E_DIVERGED,
    e_diverged_energy = SUPPLE_E_DIVERGED_ENERGY,
    e_diverged_force = SUPPLE_E_DIVERGED_FORCE,
    e_diverged_motion = SUPPLE_E_DIVERGED_MOTION,
    e_diverged_instrument = SUPPLE_E_DIVERGED_INSTRUMENT,
    e_no_contact = SUPPLE_E_NO_CONTACT,
    e_no_pulls = SUPPLE_E_NO_PULLS,
    e_no_relaxation = SUPPLE_E_NO_RELAXATION,
    e_diverged_pressure = SUPPLE_E_DIVERGED_PRESSURE,
    e_open_surface = SUPPLE_E_OPEN_SURFACE,
};

// For all elements of a scene; each with its constants in the order of tissue::constants. tools/header.sh writes this list.
enum class law : std::uint32_t {
    neo_hookean = SUPPLE_NEO_HOOKEAN, // c (Pa), d (Pa)
    exponential = SUPPLE_EXPONENTIAL, // a (Pa), b, d (Pa)
    polynomial = SUPPLE_POLYNOMIAL, // c (Pa), e (Pa), d (Pa)
};

// linear: tetrahedra that lock, that is bend too little, where tissue hardly changes its volume. nodal_pressure: these do not.
// nodal_strain: these bend well on coarse meshes as well, and need more memory.
enum class element : std::uint32_t {
    linear = SUPPLE_LINEAR,
    nodal_pressure = SUPPLE_NODAL_PRESSURE,
    nodal_strain = SUPPLE_NODAL_STRAIN
};

// checked: elements must have positive volumes. normalised: they are turned where needed.
enum class winding : std::uint32_t { checked = SUPPLE_WINDING_CHECKED, normalised = SUPPLE_WINDING_NORMALISED };

// Instructions that steps use.
enum class level : std::uint32_t {
    portable = SUPPLE_LEVEL_PORTABLE,
    avx2 = SUPPLE_LEVEL_AVX2,
    avx512 = SUPPLE_LEVEL_AVX512,
    neon = SUPPLE_LEVEL_NEON,
    simd128 = SUPPLE_LEVEL_SIMD128
};

// Whether a call did what it was asked for, with a remark or without.
[[nodiscard]] constexpr bool is_done(status code) noexcept { return static_cast<std::int32_t>(code) >= 0; }

// A sentence without numbers; there for as long as the library is.
[[nodiscard]] inline const char *text(status code) noexcept {
    return supple_status_text(static_cast<std::int32_t>(code));
}

// Elements of an array that belongs to somebody else.
template <class T> class span {
public:
    constexpr span() noexcept = default;
    constexpr span(T *first, std::size_t count) noexcept : first_(first), count_(count) {}
    template <std::size_t Count>
    constexpr span(T (&array)[Count]) noexcept : first_(array), count_(Count) {}
    // Of anything with data() and size(): std::vector, std::array, std::span.
    template <class Array, class Data = decltype(std::declval<Array &>().data()),
              class = std::enable_if_t<std::is_convertible_v<std::remove_pointer_t<Data> (*)[], T (*)[]>>>
    constexpr span(Array &&array) noexcept : first_(array.data()), count_(array.size()) {}

    [[nodiscard]] constexpr T *data() const noexcept { return first_; }
    [[nodiscard]] constexpr std::size_t size() const noexcept { return count_; }
    [[nodiscard]] constexpr T &operator[](std::size_t index) const noexcept { return first_[index]; }
    [[nodiscard]] constexpr T *begin() const noexcept { return first_; }
    [[nodiscard]] constexpr T *end() const noexcept { return first_ + count_; }

private:
    T *first_ = nullptr;
    std::size_t count_ = 0;
};

namespace detail {

// `void` with or without const, and its bytes.
template <class Void> class raw {
    template <class T> static constexpr bool fits = std::is_convertible_v<T *, Void *> &&
                                                    std::is_trivially_copyable_v<T>;

public:
    constexpr raw() noexcept = default;
    constexpr raw(Void *first, std::size_t bytes) noexcept : first_(first), bytes_(bytes) {}
    template <class T, std::size_t Count, class = std::enable_if_t<fits<T>>>
    constexpr raw(T (&array)[Count]) noexcept : first_(array), bytes_(sizeof array) {}
    template <class Array, class Data = decltype(std::declval<Array &>().data()),
              class = std::enable_if_t<fits<std::remove_pointer_t<Data>>>>
    constexpr raw(Array &&array) noexcept : first_(array.data()), bytes_(array.size() * sizeof *array.data()) {}

    [[nodiscard]] constexpr Void *data() const noexcept { return first_; }
    [[nodiscard]] constexpr std::size_t size() const noexcept { return bytes_; }

private:
    Void *first_ = nullptr;
    std::size_t bytes_ = 0;
};

constexpr status of(supple_status code) noexcept { return static_cast<status>(code); }
constexpr supple_status of(status code) noexcept { return static_cast<supple_status>(code); }

// Of functions that tell no more than a status, value and limit are not known: NaN.
inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

constexpr error nothing(status code, double value = unknown, double limit = unknown) noexcept {
    return {of(code), none, none, none, value, limit};
}

template <class Config> constexpr Config config() noexcept {
    Config made{};
    made.struct_size = sizeof(Config);
    made.abi = SUPPLE_ABI;
    return made;
}

// That no status of supple.h is forgotten above: with -Wall compilers warn of one that is missing in this switch.
constexpr bool every(supple_status code) noexcept {
    using s = status;
    switch (code) {
    case of(s::ok): case of(s::limited): case of(s::outside): case of(s::fell_back): case of(s::inexact): case of(s::behind):
    case of(s::e_null): case of(s::e_misaligned): case of(s::e_short): case of(s::e_abi): case of(s::e_not_initialised):
    case of(s::e_kind): case of(s::e_choice): case of(s::e_mismatch): case of(s::e_capacity):
    case of(s::e_index): case of(s::e_not_finite): case of(s::e_negative): case of(s::e_overlap):
    case of(s::e_element): case of(s::e_points):
#ifdef SUPPLE_IO
    case of(s::e_file):
#endif
    case of(s::e_mesh_empty): case of(s::e_mesh_repeated_node): case of(s::e_mesh_degenerate):
    case of(s::e_mesh_inverted): case of(s::e_mesh_unused_node): case of(s::e_constant):
    case of(s::e_density): case of(s::e_tissue): case of(s::e_nothing_moves): case of(s::e_law):
    case of(s::e_not_held): case of(s::e_no_step): case of(s::e_step): case of(s::e_unstable):
    case of(s::e_weights_misaligned): case of(s::e_weights_short): case of(s::e_not_weights):
    case of(s::e_weights_version): case of(s::e_weights_checksum): case of(s::e_weights_content):
    case of(s::e_weights_shape): case of(s::e_not_led): case of(s::e_step_ratio): case of(s::e_damping):
    case of(s::e_lattice): case of(s::e_too_stiff): case of(s::e_not_saved): case of(s::e_saved_version):
    case of(s::e_saved_checksum): case of(s::e_level): case of(s::e_grid): case of(s::e_diverged):
    case of(s::e_diverged_energy): case of(s::e_diverged_force): case of(s::e_diverged_motion):
    case of(s::e_instrument): case of(s::e_field): case of(s::e_diverged_instrument): case of(s::e_no_contact):
    case of(s::e_pull): case of(s::e_no_nodes): case of(s::e_no_pulls): case of(s::e_diverged_pressure):
    case of(s::e_relaxation_share): case of(s::e_relaxation_time): case of(s::e_no_relaxation):
    case of(s::e_fibres): case of(s::e_direction): case of(s::e_open_surface): return true;
    }
    return false;
}
static_assert(every(SUPPLE_OK));

// What index, value and limit of an error stand for; what does not apply is left out of sentences.
struct meaning {
    const char *index;
    const char *unit;
    bool has_value;
    bool has_limit;
};

constexpr meaning meaning_of(status code) noexcept {
    switch (code) {
    case status::e_short:
    case status::e_mismatch:
    case status::e_capacity:
    case status::e_abi:
    case status::e_weights_short: return {"entry", "", true, true};
    case status::e_choice: return {"entry", "", true, false};
    case status::e_index: return {"entry", "", false, true};
    case status::e_not_finite:
    case status::e_negative: return {"entry", "", true, false};
    case status::e_mesh_degenerate:
    case status::e_mesh_inverted: return {"element", " m^3", true, false};
    case status::e_constant: return {"element", "", true, false};
    case status::e_density: return {"element", " kg/m^3", true, false};
    case status::e_points:
    case status::e_mesh_repeated_node:
    case status::e_tissue: return {"element", "", false, false};
    case status::e_law: return {"entry", "", true, false};
    case status::e_not_held: return {"motion", "", false, false};
    case status::e_step: return {"entry", " s", true, false};
    case status::e_unstable:
    case status::e_step_ratio: return {"entry", " s", true, true};
    case status::e_weights_version:
    case status::e_weights_shape:
    case status::e_saved_version: return {"entry", "", true, false};
    case status::e_weights_content: return {"layer", "", true, false};
    case status::e_damping: return {"entry", " 1/s", true, true};
    case status::e_diverged_energy: return {"entry", " J", true, true};
    case status::e_diverged_force: return {"force", "", true, true};
    case status::e_diverged_pressure: return {"surface", "", true, true};
    case status::e_open_surface: return {"surface", "", false, false};
    case status::e_diverged_motion: return {"entry", " m", true, true};
    case status::e_diverged_instrument: return {"instrument", " m", true, true};
    case status::e_instrument: return {"instrument", "", true, false};
    case status::e_field: return {"instrument", "", false, false};
    case status::e_pull: return {"pull", "", true, false};
    case status::e_no_nodes: return {"pull", " m", true, true};
    case status::e_relaxation_share: return {"tissue", "", true, true};
    case status::e_relaxation_time: return {"tissue", " s", true, true};
    case status::e_fibres: return {"tissue", "", true, false};
    case status::e_direction: return {"element", "", false, false};
    case status::e_no_relaxation: return {"entry", " bytes", true, true};
    case status::e_grid: return {"entry", "", true, false};
    default: return {"entry", "", false, false};
    }
}

} // namespace detail

// Memory for an object, aligned to supple::align; of an array, std::vector, std::array, or pointer and bytes.
using memory = detail::raw<void>;
// Bytes that are only read, such as a weight file, in the same ways.
using bytes = detail::raw<const void>;

// Something that was made, or why it was not. `value` is of use only if `made`.
template <class T> struct [[nodiscard]] result {
    supple::status status;
    supple::error error;
    T value;

    [[nodiscard]] constexpr explicit operator bool() const noexcept { return is_done(status); }
};

// Writes a sentence with place and value, cut where the buffer ends, and returns the buffer; "" without one.
[[nodiscard]] inline const char *describe(const error &what, span<char> out) noexcept {
    if (out.size() == 0) return "";
    const status code = detail::of(what.status);
    const detail::meaning means = detail::meaning_of(code);
    std::size_t used = 0;
    const auto add = [&](int written) {
        used += written > 0 ? static_cast<std::size_t>(written) : 0;
        if (used >= out.size()) used = out.size() - 1;
    };
    const auto at = [&] { return out.data() + used; };
    const auto left = [&] { return out.size() - used; };
    const char *next = ": ";
    const auto separate = [&] { add(std::snprintf(at(), left(), "%s", next)), next = ", "; };
    add(std::snprintf(at(), left(), "%s", text(code)));
    if (what.index != none) separate(), add(std::snprintf(at(), left(), "%s %lu", means.index, 0ul + what.index));
    if (what.node != none) separate(), add(std::snprintf(at(), left(), "node %lu", 0ul + what.node));
    if (what.axis < 3 && code == status::e_fibres) {
        const char *const terms[] = {"fibres", "sheets", "coupling"};
        separate(), add(std::snprintf(at(), left(), "%s", terms[what.axis]));
    } else if (what.axis < 3 && (code == status::e_relaxation_share || code == status::e_relaxation_time))
        separate(), add(std::snprintf(at(), left(), "term %lu", 0ul + what.axis));
    else if (what.axis < 3 && code == status::e_negative) {
        const char *const quantities[] = {"tolerance", "damping", "time"};
        separate(), add(std::snprintf(at(), left(), "%s", quantities[what.axis]));
    } else if (what.axis < 3)
        separate(), add(std::snprintf(at(), left(), "axis %c", "xyz"[what.axis]));
    const bool is_known = what.value == what.value || what.limit == what.limit;
    if (means.has_value && is_known)
        separate(), add(std::snprintf(at(), left(), "%.6g%s", what.value, means.unit));
    if (means.has_limit && what.limit == what.limit)
        separate(), add(std::snprintf(at(), left(), "against %.6g%s", what.limit, means.unit));
    return out.data();
}

// Whether the library has the interface of this header.
[[nodiscard]] inline bool is_of_this_abi() noexcept { return supple_abi() == SUPPLE_ABI; }

// Such as "0.1.0".
[[nodiscard]] inline const char *version() noexcept { return supple_version(); }

// The instructions that steps use.
[[nodiscard]] inline level current_level() noexcept { return static_cast<level>(supple_level()); }

// Makes all later steps of this process use these instructions. Call it before threads take steps.
inline status set_level(level chosen) noexcept {
    return detail::of(supple_set_level(static_cast<std::uint32_t>(chosen)));
}

// What a scene is built from. All is copied.
struct body {
    supple::law law = law::neo_hookean;
    supple::element element = element::nodal_pressure;
    supple::winding winding = winding::checked;
    span<const float> points;               // three coordinates of each node, m
    span<const std::uint32_t> tetrahedra;   // four nodes of each element, from zero
    span<const support> supports;
    span<const tissue> tissues;
    span<const std::uint16_t> tissue_of_element; // with one tissue: empty
    span<const std::uint8_t> removed;            // for each element 1 if it is removed; empty: none is
    span<const supple::prony> prony;             // how each tissue relaxes; empty: none does
    span<const supple::fibres> fibres;           // of each tissue; empty: none has any
    span<const float> directions;                // with fibres: six numbers for each element, along fibres and sheets
};

namespace detail {

template <class T> bool config_of(const body &from, supple_scene_config &config, result<T> &answer) noexcept {
    const auto refuse = [&](status code, std::size_t value, std::size_t limit) {
        answer.status = code;
        answer.error = nothing(code, static_cast<double>(value), static_cast<double>(limit));
        return false;
    };
    const std::size_t elements = from.tetrahedra.size() / 4;
    for (const std::size_t count : {from.points.size(), from.tetrahedra.size(), from.supports.size()})
        if (count > UINT32_MAX) return refuse(status::e_capacity, count, UINT32_MAX);
    if (from.tissues.size() > UINT16_MAX) return refuse(status::e_capacity, from.tissues.size(), UINT16_MAX);
    if (from.points.size() % 3 != 0)
        return refuse(status::e_short, from.points.size(), from.points.size() / 3 * 3 + 3);
    if (from.tetrahedra.size() % 4 != 0) return refuse(status::e_short, from.tetrahedra.size(), elements * 4 + 4);
    if (from.tissues.size() > 1 && from.tissue_of_element.size() < elements)
        return refuse(status::e_short, from.tissue_of_element.size(), elements);
    if (from.removed.size() > 0 && from.removed.size() < elements) return refuse(status::e_short, from.removed.size(), elements);
    if (from.prony.size() > 0 && from.prony.size() < from.tissues.size())
        return refuse(status::e_short, from.prony.size(), from.tissues.size());
    if (from.fibres.size() > 0 && from.fibres.size() < from.tissues.size())
        return refuse(status::e_short, from.fibres.size(), from.tissues.size());
    if (from.directions.size() > 0 && from.directions.size() / 6 < elements)
        return refuse(status::e_short, from.directions.size(), 6 * elements);
    config = detail::config<supple_scene_config>();
    config.prony = from.prony.size() > 0 ? from.prony.data() : nullptr;
    config.fibres = from.fibres.size() > 0 ? from.fibres.data() : nullptr;
    config.directions = from.directions.size() > 0 ? from.directions.data() : nullptr;
    config.removed = from.removed.size() > 0 ? from.removed.data() : nullptr;
    config.law = static_cast<std::uint32_t>(from.law);
    config.winding = static_cast<std::uint32_t>(from.winding);
    config.element = static_cast<std::uint32_t>(from.element);
    config.nodes = static_cast<std::uint32_t>(from.points.size() / 3);
    config.elements = static_cast<std::uint32_t>(elements);
    config.supports = static_cast<std::uint32_t>(from.supports.size());
    config.tissues = static_cast<std::uint32_t>(from.tissues.size());
    config.points = from.points.data();
    config.tetrahedra = from.tetrahedra.data();
    config.support = from.supports.data();
    config.tissue = from.tissues.data();
    config.tissue_of_element = from.tissues.size() > 1 ? from.tissue_of_element.data() : nullptr;
    return true;
}

} // namespace detail

// What is simulated. Any number of threads may use one at the same time.
class scene {
public:
    constexpr scene() noexcept = default;
    constexpr explicit scene(supple_scene *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_scene *raw() const noexcept { return raw_; }

    // Bytes of memory that are enough to build one; what it then takes of them is in its facts.
    [[nodiscard]] static constexpr std::size_t size(std::uint32_t nodes, std::uint32_t elements, std::uint32_t tissues = 1,
                                                    element of = element::nodal_pressure, bool relaxes = false,
                                                    bool has_fibres = false) noexcept {
        return SUPPLE_SCENE_SIZE(nodes, elements, tissues) + (relaxes ? SUPPLE_PRONY_SIZE(tissues) : 0) +
               (has_fibres ? SUPPLE_FIBRES_SIZE(nodes, elements, tissues, static_cast<std::uint32_t>(of)) : 0) +
               (of == element::nodal_strain ? SUPPLE_PATCHES_SIZE(nodes, elements, tissues) : 0);
    }

    // Builds one in memory of at least `size` bytes.
    static result<scene> make(memory place, const body &from) noexcept {
        result<scene> made{status::ok, detail::nothing(status::ok), {}};
        supple_scene_config config;
        if (!detail::config_of(from, config, made)) return made;
        made.status =
            detail::of(supple_scene_init(place.data(), place.size(), &config, &made.value.raw_, &made.error));
        return made;
    }

    // Other constants, of the same densities: nobody may use it meanwhile; then state::carry_on.
    status set_tissues(span<const tissue> others, error *why = nullptr) const noexcept {
        const auto count = static_cast<std::uint32_t>(others.size() < none ? others.size() : none);
        return detail::of(supple_set_tissues(raw_, others.data(), count, why));
    }

    // Sizes and costs.
    [[nodiscard]] result<scene_facts> describe() const noexcept {
        result<scene_facts> facts{};
        facts.status = detail::of(supple_scene_describe(raw_, &facts.value));
        facts.error = detail::nothing(facts.status);
        return facts;
    }

private:
    supple_scene *raw_ = nullptr;
};

class contact;
class pulls;

class pressure;

// What acts on a scene. One thread at a time.
class loads {
public:
    // No loads: supports stand still.
    constexpr loads() noexcept = default;
    constexpr explicit loads(supple_loads *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_loads *raw() const noexcept { return raw_; }

    // Bytes of memory that some with room for so many forces and motions need.
    [[nodiscard]] static constexpr std::size_t size(std::uint32_t forces, std::uint32_t motions) noexcept {
        return SUPPLE_LOADS_SIZE(forces, motions);
    }

    // Prepares them, none yet, in memory of at least `size` bytes.
    static result<loads> make(memory place, scene of, std::uint32_t forces, std::uint32_t motions) noexcept {
        result<loads> made{};
        made.status = detail::of(
            supple_loads_init(place.data(), place.size(), of.raw(), forces, motions, &made.value.raw_));
        made.error = detail::nothing(made.status);
        return made;
    }

    // m/s^2.
    status set_gravity(const std::array<float, 3> &gravity) const noexcept {
        return detail::of(supple_set_gravity(raw_, gravity.data()));
    }

    // Replaces all forces; they are copied.
    status set_forces(span<const force> all, error *why = nullptr) const noexcept {
        if (all.size() > UINT32_MAX) return too_many(all.size(), why);
        const auto count = static_cast<std::uint32_t>(all.size());
        return detail::of(supple_set_forces(raw_, all.data(), count, why));
    }

    // Replaces all motions; they are copied. A ramp of zero: reached evenly over the next call that takes steps.
    status set_motions(scene of, span<const motion> all, error *why = nullptr) const noexcept {
        if (all.size() > UINT32_MAX) return too_many(all.size(), why);
        const auto count = static_cast<std::uint32_t>(all.size());
        return detail::of(supple_set_motions(raw_, of.raw(), all.data(), count, why));
    }

    // Lets pressures act where these loads do; a pressure() ends that.
    status set_pressure(const pressure &with) const noexcept;

    // Lets the instruments of a contact touch what these loads act on; a contact() ends that.
    status set_contact(const contact &with) const noexcept;
    // Lets pulls act as well; pulls() ends that.
    status set_pulls(const pulls &with) const noexcept;

private:
    static status too_many(std::size_t count, error *why) noexcept {
        if (why) *why = detail::nothing(status::e_capacity, static_cast<double>(count), UINT32_MAX);
        return status::e_capacity;
    }

    supple_loads *raw_ = nullptr;
};

// Vectors of a state where they are, three floats each. Read them between calls that change the state.
class vectors {
public:
    constexpr vectors() noexcept = default;
    constexpr explicit vectors(const supple_vectors &raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr std::uint32_t size() const noexcept { return raw_.count; }
    [[nodiscard]] const float *operator[](std::uint32_t node) const noexcept {
        return reinterpret_cast<const float *>(reinterpret_cast<const unsigned char *>(raw_.first) +
                                               raw_.stride * node);
    }

private:
    supple_vectors raw_{};
};

// Bound on the stable step, and the node that sets it.
struct critical_step {
    float seconds;
    std::uint32_t node;
};

// Simulated time, and steps taken.
struct moment {
    double seconds;
    std::uint64_t steps;
};

// What moves. One thread at a time. It may be copied with memcpy.
class state {
public:
    constexpr state() noexcept = default;
    constexpr explicit state(supple_state *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_state *raw() const noexcept { return raw_; }

    // Bytes of memory that one needs.
    [[nodiscard]] static constexpr std::size_t size(std::uint32_t nodes,
                                                    element of = element::nodal_pressure) noexcept {
        return SUPPLE_STATE_SIZE(nodes, static_cast<std::uint32_t>(of));
    }
    // Bytes that it needs more for what tissue that relaxes remembers; `terms` of the tissue that has most.
    [[nodiscard]] static constexpr std::size_t relaxation_size(std::uint32_t nodes, std::uint32_t elements, std::uint32_t tissues,
                                                               element of, std::uint32_t terms) noexcept {
        return SUPPLE_RELAXATION_SIZE(nodes, elements, tissues, static_cast<std::uint32_t>(of), terms);
    }

    // Prepares one, at rest, in memory of at least `size` bytes.
    static result<state> make(memory place, scene of) noexcept {
        result<state> made{};
        made.status = detail::of(supple_state_init(place.data(), place.size(), of.raw(), &made.value.raw_));
        made.error = detail::nothing(made.status);
        return made;
    }

    // Back to rest at time zero; the step stays.
    status reset() const noexcept { return detail::of(supple_state_reset(raw_)); }

    // Stops all motion: to go on from a state with more energy than loads and supports gave.
    status stop(const scene &of) const noexcept { return detail::of(supple_state_stop(of.raw(), raw_)); }

    // Puts the nodes at these displacements, m, three components each, at a stop.
    status set_displacements(scene of, span<const float> displacements, error *why = nullptr) const noexcept {
        const std::size_t nodes = displacements.size() / 3;
        return detail::of(supple_set_displacements(of.raw(), raw_, displacements.data(),
                                                   static_cast<std::uint32_t>(nodes < none ? nodes : none), why));
    }

    // Brings the body to rest to within so many metres, in at most so many steps; `room` of supple_settle_size bytes.
    status settle(scene of, loads acting, float metre, std::uint32_t most_steps, memory room, settled *out = nullptr,
                  const threads *on = nullptr) const noexcept {
        return detail::of(
            supple_settle(of.raw(), acting.raw(), raw_, metre, most_steps, on, room.data(), room.size(), out));
    }

    // Goes on in a scene that has taken the place of another one of the same nodes; steps are set anew.
    status carry_on(const scene &in) const noexcept { return detail::of(supple_state_carry_on(in.raw(), raw_)); }

    // Bound on the stable step at these displacements, s; takes as long as some steps.
    [[nodiscard]] result<supple::critical_step> critical_step(scene of) const noexcept {
        result<supple::critical_step> bound{};
        bound.status =
            detail::of(supple_critical_step(of.raw(), raw_, &bound.value.seconds, &bound.value.node));
        bound.error = detail::nothing(bound.status);
        return bound;
    }

    // Sets the exact step, s, and the damping, 1/s.
    status set_step(scene of, float seconds, float damping, error *why = nullptr) const noexcept {
        auto config = detail::config<supple_step_config>();
        config.seconds = seconds;
        config.damping = damping;
        return detail::of(supple_set_step(of.raw(), raw_, &config, why));
    }

    // Takes exact steps; all of the calling thread's, or on threads of the host.
    status step(scene of, loads acting, std::uint32_t count, report *out = nullptr,
                const threads *on = nullptr) const noexcept {
        return detail::of(supple_step(of.raw(), acting.raw(), raw_, count, on, out));
    }

    // Simulated time, s, and steps taken.
    [[nodiscard]] result<moment> now() const noexcept {
        result<moment> now{};
        now.status = detail::of(supple_state_time(raw_, &now.value.seconds, &now.value.steps));
        now.error = detail::nothing(now.status);
        return now;
    }

    // Where the displacements are, m, for as long as the state is there.
    [[nodiscard]] result<vectors> displacements() const noexcept {
        supple_vectors raw{};
        const status code = detail::of(supple_displacements(raw_, &raw));
        return {code, detail::nothing(code), vectors(raw)};
    }

    // Displacements, m, three floats a node.
    status copy_displacements(span<float> out) const noexcept {
        return detail::of(supple_copy_displacements(raw_, out.data(), out.size()));
    }

    // Points at rest (those of the scene) with their displacements, m, three floats a node.
    status copy_positions(span<const float> points, span<float> out) const noexcept {
        const auto there = displacements();
        if (there && points.size() / 3 < there.value.size()) return status::e_short;
        return detail::of(supple_copy_positions(raw_, points.data(), out.data(), out.size()));
    }

    // Velocities over the latest step, m/s, three floats a node.
    status copy_velocities(span<float> out) const noexcept {
        return detail::of(supple_copy_velocities(raw_, out.data(), out.size()));
    }

    // Forces on the nodes at the start of the latest step, N, three floats a node; minus the reaction where held.
    status copy_forces(span<float> out) const noexcept {
        return detail::of(supple_copy_forces(raw_, out.data(), out.size()));
    }

    // Bytes that a saved state has where no tissue relaxes.
    [[nodiscard]] static std::size_t saved_size(std::uint32_t nodes) noexcept { return supple_saved_size(nodes); }
    // Bytes that this one has.
    [[nodiscard]] result<std::size_t> saved_size() const noexcept {
        result<std::size_t> bytes{};
        bytes.status = detail::of(supple_state_saved_size(raw_, &bytes.value));
        bytes.error = detail::nothing(bytes.status);
        return bytes;
    }

    // Saves the state with its step, to any address.
    status save(memory to) const noexcept { return detail::of(supple_save(raw_, to.data(), to.size())); }

    // Goes on as the saved state would have, to the bit.
    status restore(bytes from) const noexcept {
        return detail::of(supple_restore(raw_, from.data(), from.size()));
    }

private:
    supple_state *raw_ = nullptr;
};

// Learned steps. One thread at a time.
class learned {
public:
    constexpr learned() noexcept = default;
    constexpr explicit learned(supple_learned *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_learned *raw() const noexcept { return raw_; }

    // Bytes of memory that they need.
    [[nodiscard]] static constexpr std::size_t size(std::uint32_t nodes, bool fallback) noexcept {
        return SUPPLE_LEARNED_SIZE(nodes, fallback);
    }

    // Prepares them in memory of at least `size` bytes. The weights are not copied: they must stay. With fallback
    // exact steps take the place of learned ones that are not to be believed, until the network is.
    static result<learned> make(memory place, scene of, bytes weights, bool fallback) noexcept {
        result<learned> made{status::ok, detail::nothing(status::ok), {}};
        auto config = detail::config<supple_learned_config>();
        config.fallback = fallback ? 1 : 0;
        config.weights = weights.data();
        config.weights_bytes = weights.size();
        made.status = detail::of(supple_learned_init(place.data(), place.size(), of.raw(), &config,
                                                     &made.value.raw_, &made.error));
        return made;
    }

    // For a motion from rest: no lead-in yet, not fallen back.
    status reset() const noexcept { return detail::of(supple_learned_reset(raw_)); }

    // What the network was trained for.
    [[nodiscard]] result<learned_facts> describe() const noexcept {
        result<learned_facts> facts{};
        facts.status = detail::of(supple_learned_describe(raw_, &facts.value));
        facts.error = detail::nothing(facts.status);
        return facts;
    }

    // The lead-in: exact steps for the nearest whole number of learned ones in so many seconds, which may be none.
    status lead(scene of, loads acting, state moved, double seconds, report *out = nullptr,
                const threads *on = nullptr) const noexcept {
        return detail::of(supple_learned_lead(of.raw(), acting.raw(), moved.raw(), raw_, seconds, on, out));
    }

    // Takes learned steps.
    status step(scene of, loads acting, state moved, std::uint32_t count, report *out = nullptr,
                const threads *on = nullptr) const noexcept {
        return detail::of(supple_learned_step(of.raw(), acting.raw(), moved.raw(), raw_, count, on, out));
    }

    // To be called whenever a guard calls learned steps inexact: the next ones are exact, if prepared with fallback.
    status fall_back(state moved) const noexcept { return detail::of(supple_learned_fall_back(raw_, moved.raw())); }

private:
    supple_learned *raw_ = nullptr;
};

// What steps beyond the critical one need.
struct large_steps {
    float seconds = 0.0f;                    // length of a step, s
    float damping = 0.0f;                    // proportional to mass, 1/s
    std::array<std::uint32_t, 3> cells = {}; // of the lattice along x, y, z; zeros: chosen for the scene
};

namespace detail {

inline supple_large_config config_of(const large_steps &steps) noexcept {
    auto made = config<supple_large_config>();
    made.seconds = steps.seconds;
    made.damping = steps.damping;
    for (std::size_t axis = 0; axis < 3; axis++) made.cells[axis] = steps.cells[axis];
    return made;
}

// The library takes the number of points on trust; here it is known.
template <class T> bool has_points(scene body, span<const float> points, result<T> &answer) noexcept {
    const auto facts = body.describe();
    answer.status = facts.status;
    answer.error = facts.error;
    if (facts && points.size() / 3 < facts.value.nodes) {
        answer.status = status::e_short;
        answer.error =
            nothing(answer.status, static_cast<double>(points.size()), 3.0 * facts.value.nodes);
    }
    return bool(answer);
}

// The same where there is only a status to tell.
inline status needs_points(scene body, span<const float> points, error *why) noexcept {
    result<bool> answer{};
    if (!has_points(body, points, answer) && why) *why = answer.error;
    return answer.status;
}

} // namespace detail

// Steps beyond the critical one. One thread at a time.
class large {
public:
    constexpr large() noexcept = default;
    constexpr explicit large(supple_large *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_large *raw() const noexcept { return raw_; }

    // Bytes of memory that they need. `points` are those of the scene, m.
    static result<std::size_t> size(scene of, span<const float> points, const large_steps &steps) noexcept {
        result<std::size_t> bytes{status::ok, detail::nothing(status::ok), 0};
        if (!detail::has_points(of, points, bytes)) return bytes;
        const auto config = detail::config_of(steps);
        bytes.status =
            detail::of(supple_large_size(of.raw(), points.data(), &config, &bytes.value, &bytes.error));
        return bytes;
    }

    // Prepares them from the state as it is, in memory of at least `size` bytes; takes as long as some steps.
    static result<large> make(memory place, scene of, state moved, span<const float> points,
                              const large_steps &steps) noexcept {
        result<large> made{status::ok, detail::nothing(status::ok), {}};
        if (!detail::has_points(of, points, made)) return made;
        const auto config = detail::config_of(steps);
        made.status = detail::of(supple_large_init(place.data(), place.size(), of.raw(), moved.raw(),
                                                   points.data(), &config, &made.value.raw_, &made.error));
        return made;
    }

    // Takes steps of the prepared method and length; all of the calling thread's, or on threads of the host.
    status step(scene of, loads acting, state moved, std::uint32_t count, report *out = nullptr,
                const threads *on = nullptr) const noexcept {
        return detail::of(supple_large_step(of.raw(), acting.raw(), moved.raw(), raw_, count, on, out));
    }

private:
    supple_large *raw_ = nullptr;
};

// Which steps a guard follows, and what error it allows.
struct guarded_steps {
    float seconds = 0.0f;    // length of a step, s
    float damping = 0.0f;    // proportional to mass, 1/s
    std::uint32_t every = 3; // how many times as long the second run's steps are; 1 for learned steps
    float tolerance = 0.0f;  // mean error of the nodes, m; 0: a fifth of the motion, where that is much
};

// Estimates the error of steps of any kind with a second run. One thread at a time.
class guard {
public:
    constexpr guard() noexcept = default;
    constexpr explicit guard(supple_guard *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_guard *raw() const noexcept { return raw_; }

    // Bytes of memory that it needs. `points` are those of the scene, m.
    static result<std::size_t> size(scene of, span<const float> points) noexcept {
        result<std::size_t> bytes{status::ok, detail::nothing(status::ok), 0};
        if (!detail::has_points(of, points, bytes)) return bytes;
        bytes.status = detail::of(supple_guard_size(of.raw(), points.data(), &bytes.value, &bytes.error));
        return bytes;
    }

    // Prepares it from the state as it is, in memory of at least `size` bytes; takes as long as some steps.
    static result<guard> make(memory place, scene of, state moved, span<const float> points,
                              const guarded_steps &steps) noexcept {
        result<guard> made{status::ok, detail::nothing(status::ok), {}};
        if (!detail::has_points(of, points, made)) return made;
        auto config = detail::config<supple_guard_config>();
        config.seconds = steps.seconds;
        config.damping = steps.damping;
        config.every = steps.every;
        config.tolerance = steps.tolerance;
        made.status = detail::of(supple_guard_init(place.data(), place.size(), of.raw(), moved.raw(), points.data(),
                                                   &config, &made.value.raw_, &made.error));
        return made;
    }

    // After each call that moves the state, with the same loads: `inexact` if the error is more than is allowed.
    status follow(scene of, loads acting, state moved, estimate *out = nullptr,
                  const threads *on = nullptr) const noexcept {
        return detail::of(supple_guard_follow(of.raw(), acting.raw(), moved.raw(), raw_, on, out));
    }

private:
    supple_guard *raw_ = nullptr;
};

// Steps that become as long as a tolerance allows. One thread at a time.
class adaptive {
public:
    constexpr adaptive() noexcept = default;
    constexpr explicit adaptive(supple_adaptive *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_adaptive *raw() const noexcept { return raw_; }

    // Bytes of memory that they need. `points` are those of the scene, m.
    static result<std::size_t> size(scene of, span<const float> points, const large_steps &longest) noexcept {
        result<std::size_t> bytes{status::ok, detail::nothing(status::ok), 0};
        if (!detail::has_points(of, points, bytes)) return bytes;
        const auto config = detail::config_of(longest);
        bytes.status =
            detail::of(supple_adaptive_size(of.raw(), points.data(), &config, &bytes.value, &bytes.error));
        return bytes;
    }

    // Prepares them from the state as it is, in memory of at least `size` bytes; takes as long as some steps. The
    // longest step is usually a frame; the tolerance is the mean error of the nodes that you accept, m.
    static result<adaptive> make(memory place, scene of, state moved, span<const float> points,
                                 const large_steps &longest, float tolerance) noexcept {
        result<adaptive> made{status::ok, detail::nothing(status::ok), {}};
        if (!detail::has_points(of, points, made)) return made;
        const auto config = detail::config_of(longest);
        made.status = detail::of(supple_adaptive_init(place.data(), place.size(), of.raw(), moved.raw(), points.data(),
                                                      &config, tolerance, &made.value.raw_, &made.error));
        return made;
    }

    // Moves on by so many seconds, usually a frame, and ends there exactly.
    status advance(scene of, loads acting, state moved, float seconds, report *out = nullptr,
                   adaptive_report *taken = nullptr, const threads *on = nullptr) const noexcept {
        return detail::of(
            supple_adaptive_advance(of.raw(), acting.raw(), moved.raw(), raw_, seconds, on, out, taken));
    }

private:
    supple_adaptive *raw_ = nullptr;
};

// A rigid instrument.
struct instrument {
    supple_instrument raw{};

    // All below z = 0 of its axes; a ball; a cylinder along z with round ends (length between their centres); m.
    static instrument plane(const pose &at, float friction = 0.0f) noexcept { return of(SUPPLE_PLANE, at, friction); }
    static instrument sphere(float radius, const pose &at, float friction = 0.0f) noexcept {
        return of(SUPPLE_SPHERE, at, friction, radius);
    }
    static instrument capsule(float radius, float length, const pose &at, float friction = 0.0f) noexcept {
        return of(SUPPLE_CAPSULE, at, friction, radius, length);
    }
    // Any form, from the bytes of a field's file, which must stay.
    static instrument field(bytes file, const pose &at, float friction = 0.0f) noexcept {
        instrument made = of(SUPPLE_FIELD, at, friction);
        made.raw.field = file.data(), made.raw.field_bytes = file.size();
        return made;
    }

private:
    static instrument of(std::uint32_t shape, const pose &at, float friction, float radius = 0.0f, float length = 0.0f) noexcept {
        return {supple_instrument{shape, radius, length, friction, at, nullptr, 0}};
    }
};

// Not turned.
[[nodiscard]] inline pose pose_at(const std::array<float, 3> &position) noexcept {
    return {{position[0], position[1], position[2]}, {0.0f, 0.0f, 0.0f, 1.0f}};
}

// The triangles of the boundary of a mesh, seen from outside: three numbers each at the beginning of `out`, which has room for twelve
// an element. Gives how many triangles they are.
inline result<std::size_t> boundary(span<const std::uint32_t> tetrahedra, span<std::uint32_t> out) noexcept {
    result<std::size_t> count{status::ok, detail::nothing(status::ok), 0};
    const std::size_t elements = tetrahedra.size() / 4;
    std::uint32_t found = 0;
    count.status = elements < none ? detail::of(supple_boundary(tetrahedra.data(), static_cast<std::uint32_t>(elements), out.data(),
                                                                out.size() / 3, &found))
                                   : status::e_capacity;
    count.error = detail::nothing(count.status);
    count.value = found;
    return count;
}

// Pressures that follow the surface of a body. One thread at a time.
class pressure {
public:
    // None.
    constexpr pressure() noexcept = default;
    constexpr explicit pressure(supple_pressure *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_pressure *raw() const noexcept { return raw_; }

    // Bytes of memory that some on so many triangles and surfaces need.
    [[nodiscard]] static constexpr std::size_t size(std::uint32_t triangles, std::uint32_t surfaces = 1) noexcept {
        return SUPPLE_PRESSURE_SIZE(triangles, surfaces);
    }

    // Prepares them, zero yet, on triangles as of boundary(), all of one surface or each of its own in `surface_of`.
    static result<pressure> make(memory place, scene of, span<const float> points, span<const std::uint32_t> triangles,
                                 span<const std::uint32_t> surface_of = {}, std::uint32_t surfaces = 1) noexcept {
        result<pressure> made{};
        const std::size_t count = triangles.size() / 3;
        const bool fits = points.size() / 3 >= of.describe().value.nodes && count < none &&
                          (surface_of.size() == 0 || surface_of.size() >= count);
        if (!fits) {
            made.status = status::e_short;
            made.error = detail::nothing(made.status);
            return made;
        }
        made.status = detail::of(supple_pressure_init(place.data(), place.size(), of.raw(), points.data(), triangles.data(),
                                                      surface_of.data(), static_cast<std::uint32_t>(count), surfaces,
                                                      &made.value.raw_, &made.error));
        return made;
    }

    // Sets the pressure on a surface, Pa: positive where it presses the tissue.
    status set(float pascal, float ramp = 0.0f, std::uint32_t surface = 0) const noexcept {
        return detail::of(supple_pressure_set(raw_, surface, pascal, ramp));
    }

    // Asks for the volume within a closed surface, m^3, with a stiffness, Pa; of zero: no more.
    status fill(float cubic_metres, float bulk, std::uint32_t surface = 0) const noexcept {
        return detail::of(supple_pressure_fill(raw_, surface, cubic_metres, bulk));
    }

    // Volume within a closed surface, m^3; NaN of an open one.
    [[nodiscard]] result<double> volume(state at, std::uint32_t surface = 0) const noexcept {
        result<double> found{};
        found.status = detail::of(supple_pressure_now(raw_, at.raw(), surface, &found.value, nullptr));
        found.error = detail::nothing(found.status);
        return found;
    }

    // The pressure on a surface with what fills it, Pa.
    [[nodiscard]] result<float> now(state at, std::uint32_t surface = 0) const noexcept {
        result<float> found{};
        found.status = detail::of(supple_pressure_now(raw_, at.raw(), surface, nullptr, &found.value));
        found.error = detail::nothing(found.status);
        return found;
    }

private:
    supple_pressure *raw_ = nullptr;
};

inline status loads::set_pressure(const pressure &with) const noexcept {
    return detail::of(supple_set_pressure(raw_, with.raw()));
}

// The forces of a uniform traction, Pa, on triangles of the boundary of a body of these points, for loads::set_forces: three for each.
// Where elements are removed make them again, of the triangles that are left.
inline result<std::size_t> traction(span<const float> points, span<const std::uint32_t> triangles, const std::array<float, 3> &pascal,
                                    float ramp, span<force> out) noexcept {
    result<std::size_t> count{status::ok, detail::nothing(status::ok), triangles.size() / 3 * 3};
    const auto number = [](std::size_t of) { return static_cast<std::uint32_t>(of / 3 < none ? of / 3 : none); };
    count.status = detail::of(supple_traction(points.data(), number(points.size()), triangles.data(), number(triangles.size()),
                                              pascal.data(), ramp, out.data(), out.size(), &count.error));
    return count;
}

// Where places (three coordinates each, m) are in a body at rest, for `follow`: at the beginning of `out`, the element that holds each or
// the nearest one. `work` is memory of supple_locate_size bytes, free again afterwards. Gives how many there are.
inline result<std::size_t> locate(span<const float> points, span<const std::uint32_t> tetrahedra, span<const float> places,
                                  memory work, span<followed_point> out) noexcept {
    result<std::size_t> count{status::ok, detail::nothing(status::ok), places.size() / 3};
    const auto number = [](std::size_t of) { return static_cast<std::uint32_t>(of < none ? of : none); };
    if (out.size() < count.value) {
        count.status = status::e_short;
        count.error = detail::nothing(count.status);
        count.error.value = static_cast<double>(out.size()), count.error.limit = static_cast<double>(count.value);
        return count;
    }
    count.status = detail::of(supple_locate(points.data(), number(points.size() / 3), tetrahedra.data(), number(tetrahedra.size() / 4),
                                            places.data(), number(count.value), work.data(), work.size(), out.data(), &count.error));
    return count;
}

// Where points are now, m, and how fast, m/s: three floats each; `velocities` may be empty.
inline status follow(const state &now, span<const followed_point> points, span<float> positions, span<float> velocities,
                     error *why = nullptr) noexcept {
    const std::size_t needed = 3 * points.size();
    if (positions.size() < needed || (velocities.size() != 0 && velocities.size() < needed)) return status::e_short;
    return detail::of(supple_follow(now.raw(), points.data(), static_cast<std::uint32_t>(points.size()), positions.data(),
                                    velocities.size() != 0 ? velocities.data() : nullptr, why));
}

enum class field_kind : std::uint32_t { forward = SUPPLE_FORWARD_FIELD, inverse = SUPPLE_INVERSE_FIELD };

// Bytes of scratch of a displacement field.
inline result<std::size_t> displacement_field_size(const image_grid &grid, float reach) noexcept {
    result<std::size_t> bytes{};
    bytes.status = detail::of(supple_displacement_field_size(&grid, reach, &bytes.value, &bytes.error));
    return bytes;
}

// The displacement field of a body of these points at the points of a grid, three floats each. Gives how many of these are within it.
inline result<std::size_t> displacement_field(span<const float> points, span<const std::uint32_t> tetrahedra,
                                              const supple_vectors &displacements, field_kind kind, const image_grid &grid, float reach,
                                              memory scratch, span<float> field) noexcept {
    result<std::size_t> covered{};
    const auto number = [](std::size_t of) { return static_cast<std::uint32_t>(of < none ? of : none); };
    covered.status = detail::of(supple_displacement_field(
        points.data(), number(points.size() / 3), tetrahedra.data(), number(tetrahedra.size() / 4), &displacements,
        static_cast<std::uint32_t>(kind), &grid, reach, scratch.data(), scratch.size(), field.data(), field.size(), &covered.value,
        &covered.error));
    return covered;
}

// What instruments can touch. Without `nodes` all of the scene's; `triangles`, the numbers of their three nodes each, where an
// instrument is thinner than edges are long: settings::touchable_by finds out.
struct surface {
    span<const std::uint32_t> nodes = {};
    span<const std::uint32_t> triangles = {};
};

namespace detail {

inline supple_surface surface_of(const surface &touched, std::size_t nodes) noexcept {
    const auto number = [](std::size_t of) { return static_cast<std::uint32_t>(of < none ? of : none); };
    const bool is_list = touched.nodes.size() > 0;
    return {is_list ? touched.nodes.data() : nullptr, touched.triangles.data(),
            number(is_list ? touched.nodes.size() : nodes), number(touched.triangles.size() / 3)};
}

} // namespace detail

// Instruments, what they can touch, and what one state keeps of them. One thread at a time.
class contact {
public:
    constexpr contact() noexcept = default;
    constexpr explicit contact(supple_contact *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_contact *raw() const noexcept { return raw_; }

    // Bytes of memory for so many nodes and triangles that can be touched, and so many nodes that can be held at once.
    [[nodiscard]] static std::size_t size(std::uint32_t nodes, std::uint32_t triangles = 0,
                                          std::uint32_t grips = 0) noexcept {
        return supple_contact_size(nodes, triangles, grips);
    }

    // Prepares it, without instruments yet. `points` are those of the scene at rest, m.
    static result<contact> make(memory place, scene of, span<const float> points, const surface &touched = {},
                                std::uint32_t grips = 0) noexcept {
        result<contact> made{status::ok, detail::nothing(status::ok), {}};
        if (!detail::has_points(of, points, made)) return made;
        const supple_surface given = detail::surface_of(touched, points.size() / 3);
        made.status = detail::of(supple_contact_init(place.data(), place.size(), of.raw(), points.data(), &given,
                                                     grips, &made.value.raw_, &made.error));
        return made;
    }

    // Replaces all instruments, which stand still where they are.
    status set(span<const instrument> all, error *why = nullptr) const noexcept {
        static_assert(sizeof(instrument) == sizeof(supple_instrument));
        const auto count = static_cast<std::uint32_t>(all.size() < none ? all.size() : none);
        return detail::of(supple_set_instruments(raw_, all.size() ? &all.data()->raw : nullptr, count, why));
    }

    // Lets one move, from where it is at one time to a pose at another, s; usually those of a frame.
    status move(std::uint32_t which, const pose &to, double from, double end, error *why = nullptr) const noexcept {
        return detail::of(supple_move_instrument(raw_, which, &to, from, end, why));
    }

    // Lets one hold the nodes that are nearer to it than `within`, m; and lets them go.
    status grasp(state moved, std::uint32_t which, float within, std::uint32_t *held = nullptr) const noexcept {
        return detail::of(supple_grasp(raw_, moved.raw(), which, within, held));
    }
    // Takes over the instruments of another contact, with what they hold as far as it is still there.
    status carry_on(const scene &in, const contact &from) const noexcept {
        return detail::of(supple_contact_carry_on(raw_, in.raw(), from.raw_));
    }
    status let_go(std::uint32_t which) const noexcept { return detail::of(supple_let_go(raw_, which)); }

    // What one felt in the latest steps.
    status read(std::uint32_t which, touch &out) const noexcept {
        return detail::of(supple_read_touch(raw_, which, &out));
    }

    // Where they push in the latest step; gives how many points were written.
    result<std::size_t> points(span<contact_point> out) const noexcept {
        result<std::size_t> count{status::ok, detail::nothing(status::ok), 0};
        std::uint32_t written = 0;
        const auto room = static_cast<std::uint32_t>(out.size() < none ? out.size() : none);
        count.status = detail::of(supple_contact_points(raw_, out.data(), room, &written));
        count.error = detail::nothing(count.status);
        count.value = written;
        return count;
    }

private:
    supple_contact *raw_ = nullptr;
};

inline status loads::set_contact(const contact &with) const noexcept {
    return detail::of(supple_set_contact(raw_, with.raw()));
}

using pull = supple_pull;
using pulled = supple_pulled;

// Points of the tissue that are drawn to targets. They belong to one state. One thread at a time.
class pulls {
public:
    constexpr pulls() noexcept = default;
    constexpr explicit pulls(supple_pulls *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_pulls *raw() const noexcept { return raw_; }

    // Bytes of memory for so many pulls, of so many nodes in sum; some 24 each is a good number.
    [[nodiscard]] static std::size_t size(std::uint32_t count, std::uint32_t nodes) noexcept { return supple_pulls_size(count, nodes); }

    // Prepares room, without pulls yet.
    static result<pulls> make(memory place, scene of, std::uint32_t count, std::uint32_t nodes) noexcept {
        result<pulls> made{status::ok, detail::nothing(status::ok), {}};
        made.status = detail::of(supple_pulls_init(place.data(), place.size(), of.raw(), count, nodes, &made.value.raw_));
        made.error = detail::nothing(made.status);
        return made;
    }

    // Adds one on the nodes within its radius, or on nodes with weights; it is absent until it has a target. `points` are those of the
    // scene at rest, m.
    status add(scene of, span<const float> points, const pull &wanted, error *why = nullptr) const noexcept {
        const status there = detail::needs_points(of, points, why);
        if (!is_done(there)) return there;
        return detail::of(supple_add_pull(raw_, of.raw(), points.data(), &wanted, why));
    }
    status add(scene of, span<const std::uint32_t> nodes, span<const float> weights, const pull &wanted,
               error *why = nullptr) const noexcept {
        const std::size_t count = nodes.size() < weights.size() ? nodes.size() : weights.size();
        return detail::of(supple_add_pull_of_nodes(raw_, of.raw(), nodes.data(), weights.data(),
                                                   static_cast<std::uint32_t>(count < none ? count : none), &wanted, why));
    }

    // Another stiffness, most force or direction of one.
    status change(std::uint32_t which, const pull &wanted, error *why = nullptr) const noexcept {
        return detail::of(supple_set_pull(raw_, which, &wanted, why));
    }

    // Targets of all, m, which they reach evenly from one time to another, s; usually those of a frame. NaN: absent.
    status aim(span<const float> targets, double from, double to, error *why = nullptr) const noexcept {
        const std::size_t count = targets.size() / 3;
        return detail::of(supple_set_targets(raw_, targets.data(), static_cast<std::uint32_t>(count < none ? count : none), from, to, why));
    }

    // Those of some pulls, from one on; the others go on as they do.
    status aim_from(std::uint32_t first, span<const float> targets, double from, double to, error *why = nullptr) const noexcept {
        const std::size_t count = targets.size() / 3;
        return detail::of(
            supple_set_targets_from(raw_, first, targets.data(), static_cast<std::uint32_t>(count < none ? count : none), from, to, why));
    }

    // Turns the points with the body, between frames; `most` is the largest change, m. `points` are those of the scene at rest.
    status turn(scene of, span<const float> points, state moved, float *most = nullptr) const noexcept {
        const status there = detail::needs_points(of, points, nullptr);
        if (!is_done(there)) return there;
        return detail::of(supple_turn_pulls(raw_, of.raw(), points.data(), moved.raw(), most));
    }

    // Where all are, how far from their targets, and the forces on the tissue.
    status read(state moved, span<pulled> out) const noexcept {
        return detail::of(supple_read_pulls(raw_, moved.raw(), out.data(), static_cast<std::uint32_t>(out.size() < none ? out.size() : none)));
    }

private:
    supple_pulls *raw_ = nullptr;
};

inline status loads::set_pulls(const pulls &with) const noexcept {
    return detail::of(supple_set_pulls(raw_, with.raw()));
}

// The force on an instrument between two frames, for a haptic loop.
struct local_force : supple_local_force {
    local_force() noexcept : supple_local_force{} {}

    // After each frame: position of the instrument, m, and the force on it, N.
    status follow(const float *at, const float *newton) noexcept {
        return detail::of(supple_local_force_follow(this, at, newton));
    }
    // The force at a position before the next frame.
    status at(const float *where, std::array<float, 3> &newton) const noexcept {
        return detail::of(supple_local_force_at(this, where, newton.data()));
    }
};

// The force by which supports act on the tissue, right for steps of any kind. One thread at a time.
class reaction {
public:
    constexpr reaction() noexcept = default;
    constexpr explicit reaction(supple_reaction *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_reaction *raw() const noexcept { return raw_; }

    // Bytes of memory that it needs.
    [[nodiscard]] static std::size_t size(std::uint32_t nodes) noexcept { return supple_reaction_size(nodes); }

    // Prepares it for some of the nodes that the scene holds, in memory of at least `size` bytes; takes as long as
    // some hundred steps. Damping of the steps, 1/s.
    static result<reaction> make(memory place, scene of, span<const std::uint32_t> nodes, float damping) noexcept {
        result<reaction> made{status::ok, detail::nothing(status::ok), {}};
        made.status = detail::of(supple_reaction_init(place.data(), place.size(), of.raw(), nodes.data(), nodes.size(),
                                                      damping, &made.value.raw_, &made.error));
        return made;
    }

    // Before the first step and after those of each frame: the mean force since the last call, N.
    status follow(scene of, state moved, reaction_force &out) const noexcept {
        return detail::of(supple_reaction_follow(of.raw(), moved.raw(), raw_, &out));
    }

private:
    supple_reaction *raw_ = nullptr;
};

namespace detail {

// The boundary of the elements that are left of a body, which are copied to the end of `room` if some are removed.
inline result<std::size_t> boundary_of(const body &from, span<std::uint32_t> room) noexcept {
    const std::size_t elements = from.tetrahedra.size() / 4;
    if (from.removed.size() == 0) return boundary(from.tetrahedra, room);
    const auto refuse = [](std::size_t value, std::size_t limit) -> result<std::size_t> {
        return {status::e_short, nothing(status::e_short, static_cast<double>(value), static_cast<double>(limit)), 0};
    };
    if (from.removed.size() < elements) return refuse(from.removed.size(), elements);
    std::size_t left = 0;
    for (std::size_t element = 0; element < elements; element++) left += from.removed[element] == 0;
    if (room.size() / 16 < left) return refuse(room.size(), 16 * left);
    std::uint32_t *const kept = room.data() + (room.size() - 4 * left), *next = kept;
    for (std::size_t element = 0; element < elements; element++)
        for (std::size_t corner = 0; corner < 4 && from.removed[element] == 0; corner++) *next++ = from.tetrahedra[4 * element + corner];
    return boundary({kept, 4 * left}, {room.data(), 12 * left});
}

} // namespace detail

// What moves a simulation. exact: steps below the critical one. long_steps: steps beyond it, and a guard. automatic: exact and long ones
// as long as a tolerance allows. learned: a network's.
enum class steps : std::uint32_t {
    exact = SUPPLE_STEPS_EXACT,
    long_steps = SUPPLE_STEPS_LONG,
    automatic = SUPPLE_STEPS_AUTO,
    learned = SUPPLE_STEPS_LEARNED
};

// How a scene is moved, and what there shall be room for: exact steps, unless something else is chosen.
struct settings : supple_settings {
    settings() noexcept : supple_settings{} { (void)supple_default_settings(this); }
    // Damping proportional to mass, 1/s.
    explicit settings(supple::steps by, float damping_of_mass = 0.0f) noexcept : settings() {
        supple_settings::steps = static_cast<std::uint32_t>(by);
        damping = damping_of_mass;
    }
    // What instruments can touch; it must stay until the simulation has been set up. Without a list the first `nodes`.
    settings &touchable(std::size_t nodes, const supple::surface &touched = {}, std::uint32_t grips_at_once = 0) noexcept {
        supple_settings::surface = detail::surface_of(touched, nodes);
        grips = grips_at_once;
        return *this;
    }
    // What these instruments can touch: all nodes of a body, and its boundary's triangles if one of them is thinner than edges are long.
    // `room`, twelve numbers an element, or where some are removed sixteen for each that is left, must stay until the simulation has been
    // set up.
    status touchable_by(span<const instrument> tools, const body &from, span<std::uint32_t> room, std::uint32_t grips_at_once = 0,
                        error *why = nullptr) noexcept {
        const auto found = detail::boundary_of(from, room);
        if (why) *why = found.error;
        if (!found) return found.status;
        const std::size_t nodes = from.points.size() / 3;
        std::uint32_t needed = 0;
        const auto count = static_cast<std::uint32_t>(tools.size() < none ? tools.size() : none);
        const status told = detail::of(supple_needs_triangles(
            from.points.data(), static_cast<std::uint32_t>(nodes < none ? nodes : none), room.data(),
            static_cast<std::uint32_t>(found.value), tools.size() ? &tools.data()->raw : nullptr, count, &needed, why));
        touchable(nodes, {{}, {room.data(), needed ? 3 * found.value : 0}}, grips_at_once);
        return told;
    }
    // The file of the network of learned steps; not copied: it must stay.
    settings &use_weights(supple::bytes file) noexcept {
        weights = file.data();
        weights_bytes = file.size();
        return *this;
    }
};

// A scene in motion with all that it needs, in one memory. One thread at a time; memcpy makes a copy.
class simulation {
public:
    constexpr simulation() noexcept = default;
    constexpr explicit simulation(supple_sim *raw) noexcept : raw_(raw) {}
    [[nodiscard]] constexpr supple_sim *raw() const noexcept { return raw_; }

    // The copy that memcpy has put there.
    [[nodiscard]] static simulation copy_in(memory place) noexcept { return simulation(static_cast<supple_sim *>(place.data())); }

    // Bytes of memory that are enough.
    static result<std::size_t> size(const body &from, const settings &how = {}) noexcept {
        result<std::size_t> bytes{status::ok, detail::nothing(status::ok), 0};
        supple_scene_config config;
        if (!detail::config_of(from, config, bytes)) return bytes;
        bytes.status = detail::of(supple_sim_size(&config, &how, &bytes.value, &bytes.error));
        return bytes;
    }

    // Builds a scene at rest, in memory of at least `size` bytes; takes as long as some steps.
    static result<simulation> make(memory place, const body &from, const settings &how = {}) noexcept {
        result<simulation> made{status::ok, detail::nothing(status::ok), {}};
        supple_scene_config config;
        if (!detail::config_of(from, config, made)) return made;
        made.status =
            detail::of(supple_sim_setup(place.data(), place.size(), &config, &how, &made.value.raw_, &made.error));
        return made;
    }

    // Other steps; also where lengths are chosen, after the state was reset or restored.
    status set(const settings &how, error *why = nullptr) const noexcept {
        return detail::of(supple_sim_set(raw_, &how, why));
    }

    // Goes on with other constants of its tissues, of the same densities: with the steps that there are, not automatic ones, or with
    // steps that are prepared anew.
    status set_tissues(span<const tissue> others, error *why = nullptr) const noexcept {
        const auto count = static_cast<std::uint32_t>(others.size() < none ? others.size() : none);
        return detail::of(supple_sim_set_tissues(raw_, others.data(), count, nullptr, why));
    }
    status set_tissues(span<const tissue> others, const settings &how, error *why = nullptr) const noexcept {
        const auto count = static_cast<std::uint32_t>(others.size() < none ? others.size() : none);
        return detail::of(supple_sim_set_tissues(raw_, others.data(), count, &how, why));
    }

    // Goes on where another one is, of a body of the same points, as after a resection (body::removed); `how` it was made.
    status carry_on(const simulation &from, const settings &how, error *why = nullptr) const noexcept {
        return detail::of(supple_sim_carry_on(raw_, from.raw_, &how, why));
    }

    // Moves on by so many seconds, usually a frame.
    status advance(double seconds, sim_report *out = nullptr, const threads *on = nullptr) const noexcept {
        return detail::of(supple_sim_advance(raw_, seconds, on, out));
    }

    // Brings the body to rest to within so many metres, in at most so many steps, under its loads and instruments; `room` of
    // supple_settle_size bytes.
    status settle(float metre, std::uint32_t most_steps, memory room, settled *out = nullptr,
                  const threads *on = nullptr) const noexcept {
        return detail::of(supple_sim_settle(raw_, metre, most_steps, on, room.data(), room.size(), out));
    }

    // Its objects; of none if it is no simulation.
    [[nodiscard]] supple::scene scene() const noexcept { return supple::scene(const_cast<supple_scene *>(objects().scene)); }
    [[nodiscard]] supple::state state() const noexcept { return supple::state(objects().state); }
    [[nodiscard]] supple::loads loads() const noexcept { return supple::loads(objects().loads); }
    [[nodiscard]] supple::contact contact() const noexcept { return supple::contact(objects().contact); }
    // The network of learned steps, for its describe() and for remarks(); of other steps none.
    [[nodiscard]] supple::learned learned() const noexcept { return supple::learned(const_cast<supple_learned *>(objects().learned)); }
    // Bytes of its memory that are in use.
    [[nodiscard]] std::size_t bytes() const noexcept { return objects().bytes; }

private:
    supple_sim_objects objects() const noexcept {
        supple_sim_objects found{};
        (void)supple_sim_describe(raw_, &found);
        return found;
    }

    supple_sim *raw_ = nullptr;
};

// What in a scene looks as if a unit or a number was mistaken, before the first step. Gives how many remarks there are;
// those that there is no room for are not written.
inline result<std::size_t> remarks(scene of, span<const float> points, span<remark> out, loads acting = {},
                                   learned network = {}) noexcept {
    result<std::size_t> count{status::ok, detail::nothing(status::ok), 0};
    if (!detail::has_points(of, points, count)) return count;
    std::uint32_t told = 0;
    const auto room = static_cast<std::uint32_t>(out.size() < none ? out.size() : none);
    count.status = detail::of(
        supple_remarks(of.raw(), points.data(), acting.raw(), network.raw(), out.data(), room, &told));
    count.error = detail::nothing(count.status);
    count.value = told;
    return count;
}

// What a remark means, without its numbers.
[[nodiscard]] inline const char *text(const remark &what) noexcept { return supple_remark_text(what.kind); }

} // namespace supple

#endif
