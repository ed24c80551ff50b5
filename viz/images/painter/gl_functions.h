// The functions of OpenGL 2.1 and of framebuffer objects that evalbus calls directly, looked up in the
// library in use (painter/gl_context.h). GL_GLEXT_PROTOTYPES is defined for the whole library.
#pragma once

#include <GL/gl.h>
#include <GL/glext.h>

#include <string>

#include "base/errors.h"
#include "viz/images/painter/gl_context.h"

namespace evalbus::viz {

// Returns an OpenGL function. Throws EnvironmentError if the library in use lacks it. A context must be
// current.
template <class Function>
Function* FindGl(const char* name) {
  auto* const function = reinterpret_cast<Function*>(GlFunction(name));
  if (!function) throw EnvironmentError(std::string("this OpenGL library has no function ") + name);
  return function;
}

struct GlFunctions {
#define EVALBUS_GL(name) decltype(gl##name)* const name = FindGl<decltype(gl##name)>("gl" #name)
  EVALBUS_GL(ActiveTexture);
  EVALBUS_GL(AttachShader);
  EVALBUS_GL(BindFramebuffer);
  EVALBUS_GL(BindRenderbuffer);
  EVALBUS_GL(BindTexture);
  EVALBUS_GL(BlendFunc);
  EVALBUS_GL(CallList);
  EVALBUS_GL(CheckFramebufferStatus);
  EVALBUS_GL(Clear);
  EVALBUS_GL(ClearColor);
  EVALBUS_GL(ClearDepth);
  EVALBUS_GL(Color4fv);
  EVALBUS_GL(ColorMask);
  EVALBUS_GL(CompileShader);
  EVALBUS_GL(CreateProgram);
  EVALBUS_GL(CreateShader);
  EVALBUS_GL(CullFace);
  EVALBUS_GL(DeleteFramebuffers);
  EVALBUS_GL(DeleteProgram);
  EVALBUS_GL(DeleteRenderbuffers);
  EVALBUS_GL(DeleteShader);
  EVALBUS_GL(DepthFunc);
  EVALBUS_GL(DepthMask);
  EVALBUS_GL(DepthRange);
  EVALBUS_GL(Disable);
  EVALBUS_GL(DrawBuffer);
  EVALBUS_GL(Enable);
  EVALBUS_GL(FramebufferRenderbuffer);
  EVALBUS_GL(FrontFace);
  EVALBUS_GL(GenFramebuffers);
  EVALBUS_GL(GenRenderbuffers);
  EVALBUS_GL(GetProgramInfoLog);
  EVALBUS_GL(GetProgramiv);
  EVALBUS_GL(GetUniformLocation);
  EVALBUS_GL(LinkProgram);
  EVALBUS_GL(LoadMatrixf);
  EVALBUS_GL(MatrixMode);
  EVALBUS_GL(MultMatrixf);
  EVALBUS_GL(PixelStorei);
  EVALBUS_GL(PolygonMode);
  EVALBUS_GL(PopMatrix);
  EVALBUS_GL(PushMatrix);
  EVALBUS_GL(ReadBuffer);
  EVALBUS_GL(ReadPixels);
  EVALBUS_GL(RenderbufferStorage);
  EVALBUS_GL(Scalef);
  EVALBUS_GL(Scissor);
  EVALBUS_GL(ShaderSource);
  EVALBUS_GL(TexParameteri);
  EVALBUS_GL(Translatef);
  EVALBUS_GL(Uniform1i);
  EVALBUS_GL(Uniform3fv);
  EVALBUS_GL(Uniform4fv);
  EVALBUS_GL(UniformMatrix4fv);
  EVALBUS_GL(UseProgram);
  EVALBUS_GL(Viewport);
#undef EVALBUS_GL
};

}  // namespace evalbus::viz
