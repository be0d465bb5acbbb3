/* python.exe: the DLLs of CPython come without one. */
#include <wchar.h>
#include <windows.h>

typedef int (*entry)(int, wchar_t **);

int wmain(int count, wchar_t **arguments) {
    HMODULE python = LoadLibraryW(L"python311.dll");
    if (python == NULL)
        return 101;
    entry main_of_python = (entry)(void *)GetProcAddress(python, "Py_Main");
    return main_of_python == NULL ? 102 : main_of_python(count, arguments);
}
