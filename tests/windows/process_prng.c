/* bcryptprimitives.dll: every Windows 10 has it, wine 8 does not; Rust's library asks it for
 * random bytes. They come from the same source under its older name. */
#include <windows.h>

BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) {
    while (size > 0) {
        ULONG share = size > 65536 ? 65536 : (ULONG)size;
        if (!SystemFunction036(data, share))
            return FALSE;
        data += share;
        size -= share;
    }
    return TRUE;
}
