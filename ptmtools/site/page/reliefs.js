function R({texture:o,clampU:e,clampV:r,factor:t,blends:c,cutoff:n,twoSided:i,octree:a,light:s,relief:f}){return[o,e,r,t,c,n,i,a,s,f].join()}function N(o){return o<=.0031308?12.92*o:1.055*o**(1/2.4)-.055}var E=(o="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${o}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,S=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,C=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${S}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,_=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,P=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${_}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,V=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${_}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,F={surface:[E(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),C],item:[E(),P],placeholder:[E(),V]};function I(o,e,r=F[e]){let t=o.createProgram(),c=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(r.forEach((a,s)=>{let f=o.createShader(c[s]);o.shaderSource(f,a),o.compileShader(f),o.attachShader(t,f),o.deleteShader(f)}),o.linkProgram(t),!o.getProgramParameter(t,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(t)}`);let n={},i=o.isContextLost()?0:o.getProgramParameter(t,o.ACTIVE_UNIFORMS);for(let a=0;a<i;a++){let s=o.getActiveUniform(t,a)?.name??"";n[s]=o.getUniformLocation(t,s)}return{program:t,at:n}}function O(o,{program:e,at:r},t){o.useProgram(e),o.uniform3fv(r.eye,t.eye),o.uniformMatrix3fv(r.turn,!1,t.turn),o.uniform4fv(r.lens,t.lens)}var w=class extends Error{constructor(e,r){super(r),this.code=e}};var z=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),U=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${z.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;function B(o,e,r,t=0,c=t){let n=0;for(let i=0;i<3;i++){let a=Math.max(e[t+i]-o[i],o[i]-r[c+i],0);n+=a*a}return Math.sqrt(n)}var $=[2,3,4],Y=.1,G=E(`
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 up;
layout(location = 5) in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),H=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${S}
${U}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,T=class{#e=new Map;#t=new WeakMap;#o=new WeakSet;#r=!1;constructor(e,r,t){this.gl=e,this.report=t,this.walk=r,this.program=I(e,"relief",[G,H])}delete(){for(let e of this.#e.keys())this.#i(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:r,frames:t,positions:c}=e;if(r<0||this.#o.has(e))return!1;let n=c.length/3;return t?.every((a,s)=>a.length===$[s]*n)&&this.walk.index.textures[r]?.relief!==void 0?!0:(this.#o.add(e),this.report(new w("PTM-V105",`The relief of ${e.name||"an object"} does not fit the index.`)),!1)}get lacks(){return!this.#r}get levels(){return this.walk.index.textures.flatMap(({relief:e},r)=>e===void 0?[]:[this.walk.memory.held[r]])}advance(e,r,t){this.#a();let{gl:c,walk:{catalogue:{K:n,levels:i},client:a,present:s}}=this;if(!s)return;let f=c.drawingBufferWidth*c.drawingBufferHeight,h=!1;for(let{batches:l}of e)for(let{look:m,low:u,high:d}of l){let{relief:p,blends:v}=m;if(v||!this.#n(m))continue;let x=t/2/Math.max(Y,B(r,u,d)),[y,b,M]=u.map((g,A)=>d[A]-g),k=Math.min(1,x*x*b*Math.max(y,M)/f),D=Math.max(0,Math.floor(Math.log2(this.#c(m)/x)));for(let g=1,A=p*n+1;g<=Math.max(1,i[p]-D);g++,A++)s[A]>=k||(s[A]=k,h=!0)}h&&a.sees(s,a.hidden),this.#r=!0}#a(){if(!this.#e.size)return;let{renderer:e}=this.walk,r=new Set([...e?.cells.values()??[]].flatMap(({shapes:t})=>t));for(let t of this.#e.keys())r.has(t)||this.#i(t)}#c(e){let r=this.#t.get(e);if(r)return r;let{positions:t,indices:c,relief:n,frames:i}=e,[a]=i,{width:s,height:f}=this.walk.index.textures[n],h=0,l=0;for(let u=0;u<c.length;u+=3){let[d,p,v]=c.subarray(u,u+3);h+=L(t,3,d,p,v),l+=L(a,2,d,p,v)}let m=h>0?Math.sqrt(l*s*f/h):1;return this.#t.set(e,m),m}draw(e,r,t,c){let{gl:n,program:i,walk:a}=this;O(n,i,e),n.uniform1i(i.at.relief,1);let s=!1,f=new Set;for(let{buffers:h,batch:l}of r){if(f.has(l.look))continue;f.add(l.look),n.activeTexture(n.TEXTURE1),s=a.memory.of(l.look.relief)?.bind(!0,!0,c)||s,n.activeTexture(n.TEXTURE0),s=t(i.at,l)||s;let m=R(l.look);for(let u of h.shapes){if(R(u)!==m)continue;let{array:d,count:p}=this.#f(u);n.bindVertexArray(d),n.drawElements(n.TRIANGLES,p,n.UNSIGNED_INT,0)}}return s}#f(e){let r=this.#e.get(e);if(r)return r;let{gl:t}=this,{positions:c,uvs:n,colors:i,indices:a,frames:s}=e,f=t.createVertexArray(),h=a.length;t.bindVertexArray(f);let l=[],[m,u,d]=s,p=i&&Float32Array.from(i,y=>N(y/65535)),v=[[0,c,3],[1,n,2],[2,p,4],[3,m,2],[4,u,3],[5,d,4]];for(let[y,b,M]of v)b&&(l.push(this.#s(t.ARRAY_BUFFER,b)),t.enableVertexAttribArray(y),t.vertexAttribPointer(y,M,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),l.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(a))),t.bindVertexArray(null);let x={array:f,buffers:l,count:h};return this.#e.set(e,x),x}#s(e,r){let{gl:t}=this,c=t.createBuffer();return t.bindBuffer(e,c),t.bufferData(e,r,t.STATIC_DRAW),c}#i(e){let r=this.#e.get(e);if(r){this.gl.deleteVertexArray(r.array);for(let t of r.buffers)this.gl.deleteBuffer(t);this.#e.delete(e)}}};function L(o,e,r,t,c){let n=m=>[0,1,2].map(u=>u<e?o[e*m+u]-o[e*r+u]:0),[i,a,s]=n(t),[f,h,l]=n(c);return Math.hypot(a*l-s*h,s*f-i*l,i*h-a*f)}var ae=(o,e)=>new T(o.gl,o,e);export{ae as statuesOf};
