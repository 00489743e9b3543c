// supple.h in C++: its macros for static memory, its statuses, a call.
#include <cstdio>
#include <supple.h>

SUPPLE_MEMORY(memory, SUPPLE_STATE_SIZE(12, SUPPLE_NODAL_PRESSURE));
static_assert(sizeof memory % SUPPLE_ALIGN == 0, "objects fill whole multiples of their alignment");

int main() {
    supple_state *state = nullptr;
    const supple_status status = supple_state_init(memory, sizeof memory, nullptr, &state);
    std::printf("%s\n", supple_status_text(status));
    return supple_abi() == SUPPLE_ABI && sizeof memory == supple_state_size(12, SUPPLE_NODAL_PRESSURE) && status == SUPPLE_E_NULL ? 0 : 1;
}
